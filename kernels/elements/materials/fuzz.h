// Fibres that stand on the surface: Estevez and Kulla 2017 with the shadows of Neubelt and Pettineo 2013.
#include "shading/bsdf_record.h"

INLINE void fuzz_begins(bsdf *b, const pbr *p, mask inside) {
    b->fuzz = color_scale(p->fuzz_color, p->fuzz_weight);
    b->fuzz_rough = fmax(p->fuzz_roughness, SMOOTHEST_FUZZ);
    b->fuzz_albedo = R(0.0);
    b->fuzz = color_pick(inside, color_of(R(0.0), R(0.0), R(0.0)), b->fuzz);
}

// What it takes from what is below it.
INLINE void fuzz_covers(bsdf *b, __global const float *tables) {
    if (!any_of(brightest(b->fuzz))) return;
    b->fuzz_albedo = brightest(b->fuzz) * albedo_at(tables + ALBEDO_FUZZ, b->out.z, b->fuzz_rough).of_direction;
}

// f, not times the cosine.
INLINE real fuzz_value(vec o, vec i, real roughness) {
    const real power = R(1.0) / fmax(roughness, SMOOTHEST_FUZZ);
    const vec h = middle_way(o, i);
    const real sine2 = fmax(R(1.0) - h.z * h.z, R(1e-12));
    const real density = (R(2.0) + power) * pow(sine2, R(0.5) * power) / (R(2.0) * BSDF_PI);
    return density / (R(4.0) * fmax(o.z + i.z - o.z * i.z, R(1e-6)));
}

// f * cosine of itself and of what is below it.
INLINE color fuzz_over(const bsdf *b, color below, vec i, real broad) {
    const real fibres = fuzz_value(b->out, i, b->fuzz_rough) * i.z * broad;
    return color_add(color_scale(below, R(1.0) - b->fuzz_albedo), color_scale(b->fuzz, fibres));
}
