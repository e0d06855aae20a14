// The material of a spot: what paths scatter by.
#if HAS_SUBSURFACE
// How much of the light that goes into a material meets its body, and how much its medium.
typedef struct {
    real body, medium;
} pbr_shares;

INLINE pbr_shares pbr_shares_of(const pbr *p) {
    const real below = p->subsurface_weight * (R(1.0) - p->base_metalness);
    const pbr_shares found = {R(1.0) - below, p->subsurface_weight};
    return found;
}

// Scales what only those parts of the light meet: where materials are mixed a colour counts by what it colours, and one that is not
// seen for nothing.
INLINE void pbr_weigh(pbr *p, pbr_shares by) {
    p->base_color = color_scale(p->base_color, by.body);
    p->subsurface_color = color_scale(p->subsurface_color, by.medium);
    p->subsurface_radius *= by.medium;
}

// The mean of parts that were weighed, from their sum.
INLINE void pbr_mixed(pbr *sum, pbr_shares of) {
    const pbr_shares by = {R(1.0) / fmax(of.body, R(1e-6)), R(1.0) / fmax(of.medium, R(1e-6))};
    pbr_weigh(sum, by);
}
#endif

#if !HAS_MAPS && MATERIALS == 1
INLINE pbr pbr_at(stage s, const spot *here, world w) { return pbr_of(w.materials, here->tint); }
#else
#include "bump_places.h"
#if HAS_MAPS
#include "maps.h"
#endif
#if HAS_BUMP
#include "bump.h"
#endif

// One of the materials that have layers, with its maps.
CALLED pbr pbr_mapped(stage s, const spot *here, int number, world w) {
    __constant const struct Pbr *material = w.materials + number;
    pbr p = pbr_of(material, here->tint);
#if HAS_MAPS
    real *numbers = (real *)&p;
    for (int i = 0; i < material->map_count; ++i) {
        __global const struct Map *m = w.maps + material->first_map + i;
        const color found = map_at(s, here, AT_SPOT, m, w);
        numbers[m->number] = found.r;
        if (m->count < 3) continue;
        numbers[m->number + 1] = found.g;
        numbers[m->number + 2] = found.b;
    }
#endif
    p.bending_ior = p.specular_ior;
    // Of a blend's parts what they reflect and shine is mixed, not the factors of it.
    p.base_color = color_scale(p.base_color, p.base_weight);
    p.emission_color = color_scale(p.emission_color, p.emission_luminance);
    p.base_weight = p.emission_luminance = R(1.0);
    return p;
}

INLINE pbr pbr_at(stage s, const spot *here, world w) {
#if MATERIALS == 1
    return pbr_mapped(s, here, 0, w);
#else
    // The share of each material. Blends come before their parts, and pass theirs on to them.
    real shares[MATERIALS];
    const real root = spot_material(here, w);
    for (int i = 0; i < MATERIALS; ++i) shares[i] = pick(equal(root, (real)((scalar)i)), R(1.0), R(0.0));
    pbr sum;
    real *sums = (real *)&sum;
    for (int i = 0; i < NUMBERS_OF(pbr); ++i) sums[i] = R(0.0);
#if HAS_SUBSURFACE
    pbr_shares of = {R(0.0), R(0.0)};
#endif
    for (int i = 0; i < MATERIALS; ++i) {
        if (!any_of(shares[i])) continue;
        __constant const struct Pbr *material = w.materials + i;
#if HAS_MAPS
        if (material->blend[0] >= 0) {
            const real second = map_at(s, here, AT_SPOT, w.maps + material->mask, w).r;
            shares[material->blend[0]] += shares[i] * (R(1.0) - second);
            shares[material->blend[1]] += shares[i] * second;
            continue;
        }
#endif
        pbr part = pbr_mapped(s, here, i, w);
#if HAS_SUBSURFACE
        const pbr_shares by = pbr_shares_of(&part);
        pbr_weigh(&part, by);
        of.body += shares[i] * by.body;
        of.medium += shares[i] * by.medium;
#endif
        const real *numbers = (const real *)&part;
        for (int j = 0; j < NUMBERS_OF(pbr); ++j) sums[j] += shares[i] * numbers[j];
    }
    sum.base_weight = sum.emission_luminance = R(1.0);
#if HAS_SUBSURFACE
    pbr_mixed(&sum, of);
#endif
    return sum;
#endif
}
#endif

#if HAS_FACES
// The face of a cut is a matt body in the plane's colours (Lambert's), whatever has been cut.
INLINE void pbr_of_face(const spot *here, pbr *p) {
    const mask face = on_face(here);
    const real none = R(0.0), one = R(1.0);
    const color tint = color_of(fmin(here->tint.r, one), fmin(here->tint.g, one), fmin(here->tint.b, one));
    p->base_color = color_pick(face, tint, p->base_color);
    p->base_weight = pick(face, one, p->base_weight);
    p->base_metalness = pick(face, none, p->base_metalness);
    p->base_diffuse_roughness = pick(face, none, p->base_diffuse_roughness);
    p->specular_weight = pick(face, none, p->specular_weight);
    p->coat_weight = pick(face, none, p->coat_weight);
    p->fuzz_weight = pick(face, none, p->fuzz_weight);
    p->transmission_weight = pick(face, none, p->transmission_weight);
    p->emission_luminance = pick(face, none, p->emission_luminance);
#if HAS_SUBSURFACE
    p->subsurface_weight = pick(face, none, p->subsurface_weight);
#endif
}
#endif

// What a path meets at a spot: a thing's material, where two solids flow together a blend of theirs, or the face of a cut.
INLINE pbr pbr_of_spot(stage s, const spot *here, world w) {
    pbr p = pbr_at(s, here, w);
#if JOINS_SMOOTHLY
    if (any_lane(less(R(0.0), here->share))) {
        spot one = *here, other = one;
        const real quantity = COLORING_PER_POINT ? here->smooth : here->quantity;
        other.object = here->other;
        one.share = other.share = R(0.0);
        one.tint = object_color(here->normal, quantity, one.object, w);
        other.tint = object_color(here->normal, quantity, other.object, w);
        p = pbr_at(s, &one, w);
        pbr more = pbr_at(s, &other, w);
#if HAS_SUBSURFACE
        pbr_shares of = pbr_shares_of(&p);
        const pbr_shares by = pbr_shares_of(&more);
        pbr_weigh(&p, of);
        pbr_weigh(&more, by);
        of.body += here->share * (by.body - of.body);
        of.medium += here->share * (by.medium - of.medium);
#endif
        for (int i = 0; i < NUMBERS_OF(pbr); ++i) {
            ((real *)&p)[i] += here->share * (((const real *)&more)[i] - ((real *)&p)[i]);
        }
#if HAS_SUBSURFACE
        pbr_mixed(&p, of);
#endif
    }
#endif
#if HAS_FACES
    pbr_of_face(here, &p);
#endif
    return p;
}

// About what a material reflects of white light, from wherever it comes and is looked at: what channels call albedo. A clear boundary
// counts as nothing, since what it does not mirror comes back from the body.
INLINE color pbr_albedo(const pbr *p, __global const float *tables) {
    const color white = color_of(R(1.0), R(1.0), R(1.0));
    color body = color_scale(p->base_color, p->base_weight);
#if HAS_SUBSURFACE
    body = color_mix(body, p->subsurface_color, p->subsurface_weight);
#endif
    const color base = color_mix(body, white, p->transmission_weight * (R(1.0) - p->base_metalness));
    const color below = color_mul(base, color_mix(white, p->coat_color, p->coat_weight));
    const real fibres = p->fuzz_weight * albedo_at(tables + ALBEDO_FUZZ, R(0.5), fmax(p->fuzz_roughness, SMOOTHEST_FUZZ)).mean;
    return color_mix(below, p->fuzz_color, fibres);
}
