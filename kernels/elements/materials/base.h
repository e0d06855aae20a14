// The body of a material: diffuse light of rough surfaces, or a metal.
#include "specular.h"

INLINE void base_begins(bsdf *b, const pbr *p) {
    b->metal = b->body = color_scale(p->base_color, p->base_weight);
    b->metalness = p->base_metalness;
    b->rough_body = p->base_diffuse_roughness;
    b->dielectric = R(1.0) - b->metalness;
}

// How far a metal's tint takes its reflectance below Schlick's, in parts of cosine (1 - cosine)^6: (6/7)^5, and (6/7)^6 / 7.
INLINE real metal_dip(real straight, real tint) {
    return (straight + (R(1.0) - straight) * R(0.462664366)) * (R(1.0) - tint) / R(0.0566527795);
}

// The reflectance of a metal, of (1 - cosine)^5 and cosine (1 - cosine)^6, or of their means.
INLINE real metal_reflects(real straight, real dip, real rest5, real dipped) {
    return clamp(straight + (R(1.0) - straight) * rest5 - dip * dipped, R(0.0), R(1.0));
}

// By Schlick, with a tint where the cosine is 1/7 (Kutz, Hasan, Edmondson 2021), as in OpenPBR.
INLINE real fresnel_metal(real cosine, real straight, real tint) {
    const real rest = fmax(R(1.0) - cosine, R(0.0)), rest2 = rest * rest, rest5 = rest2 * rest2 * rest;
    return metal_reflects(straight, metal_dip(straight, tint), rest5, cosine * rest5 * rest);
}

// A metal's reflectance straight on for light that meets several facets: with a film on it another one; see bsdf.h.
INLINE color film_again(const bsdf *b);

// f * cosine of a metal. Of light that is reflected more than once between its facets, `several`, the lobes have a direction: that of wider
// facets. Their colour is what the first, the last and those between reflect; see `docs/tables_facets.py`.
INLINE color metal_value(const bsdf *b, vec i, vec h, real single, real several, __global const float *tables) {
    const real meeting = vec_dot(b->out, h), wide = fmax(b->rough, (real)((scalar)REPEATED_NARROWEST_TENTHS * S(0.1)));
    const repeated o = specular_repeats(b, b->out, tables), other = specular_repeats(b, i, tables);
    const real lobe = several * (ggx_value(b->out, i, h, even_slopes(wide)) + (real)((scalar)REPEATED_EVEN_HUNDREDTHS * S(0.01)) * i.z);
    const real twice = lobe * o.twice * other.twice, more = lobe * o.more * other.more;
    // After more than two facets each time about as much goes on to the next one.
    const real onward = (real)((scalar)REPEATED_AGAIN_TENTHS * S(0.1)) * more / fmax(twice + more, (real)(REAL_SMALLEST));
    const color again = film_again(b);
    color sum;
#define METAL_PART(c)                                                                                                       \
    {                                                                                                                       \
        const real dip = metal_dip(again.c, b->edge.c);                                                                     \
        const real between = metal_reflects(again.c, dip, o.between[0], o.between[1]);                                      \
        const real ends = metal_reflects(again.c, dip, o.first[0], o.first[1])                                              \
                          * metal_reflects(again.c, dip, other.first[0], other.first[1]);                                   \
        const real repeats = twice + more * between * (R(1.0) - onward) / (R(1.0) - onward * between);                      \
        sum.c = single * fresnel_metal(meeting, b->metal.c, b->edge.c) + ends * repeats;                                    \
    }
    METAL_PART(r) METAL_PART(g) METAL_PART(b)
#undef METAL_PART
    return sum;
}

// Diffuse light of rough surfaces, with all its energy (Portsmouth, Kutz, Hill 2024, EON).
#define EON_SLOPE R(0.28779341)   // 1/2 - 2/(3 pi)
#define EON_MEAN R(0.07248821)    // 2/3 - 28/(15 pi)
INLINE real eon_albedo(real cosine, real roughness) {
    const real a = R(1.0) / (R(1.0) + EON_SLOPE * roughness);
    const real c = clamp(cosine, R(1e-4), R(1.0)), sine = sqrt(fmax(R(1.0) - c * c, R(0.0)));
    const real g = sine * (acos(c) - sine * c) + R(0.6666666666666667) * (sine / c * (R(1.0) - sine * sine * sine) - sine);
    return a * (R(1.0) + roughness * g / BSDF_PI);
}
// f, not times the cosine, of one component of the colour.
INLINE real eon_part(real base, real single, real less_o, real less_i, real mean) {
    const real several = base * base * mean / (R(1.0) - base * (R(1.0) - mean));
    return base * single + several * less_o * less_i / fmax(R(1.0) - mean, R(1e-6)) / BSDF_PI;
}
INLINE color eon_value(color base, vec o, vec i, real roughness) {
    const real a = R(1.0) / (R(1.0) + EON_SLOPE * roughness);
    const real s = o.x * i.x + o.y * i.y;  // o.i - o.z i.z
    const real over = pick(less(R(0.0), s), s / fmax(fmax(o.z, i.z), R(1e-6)), s);
    const real single = a * (R(1.0) + roughness * over) / BSDF_PI, mean = a * (R(1.0) + EON_MEAN * roughness);
    const real less_o = R(1.0) - eon_albedo(o.z, roughness), less_i = R(1.0) - eon_albedo(i.z, roughness);
    return color_of(eon_part(base.r, single, less_o, less_i, mean), eon_part(base.g, single, less_o, less_i, mean),
                    eon_part(base.b, single, less_o, less_i, mean));
}
