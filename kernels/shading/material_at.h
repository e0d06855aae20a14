// The material of an interaction: what paths scatter by.
#include "weighed.h"
NUMBERS_PICKED(pbr)

// Materials are mixed by the shares that they have in an interaction. What a part of them has counts by the weight of that part, and the
// body's colour by the light that meets the body: neither what goes through it nor what goes into it.
typedef struct {
    pbr sum;
    real weights[WEIGHED_PARTS], body;
} pbr_mix;

// What a part counts by at least, so that it is something where it has no weight in any material.
#define LEAST_WEIGHT R(1e-4)

// How much of the light meets the body.
INLINE real pbr_body(const pbr *p) {
    const real dielectric = R(1.0) - p->base_metalness;
    return LEAST_WEIGHT + (R(1.0) - p->transmission_weight * dielectric) * (R(1.0) - p->subsurface_weight * dielectric);
}

INLINE void pbr_add(pbr_mix *m, pbr part, real share) {
    real *numbers = (real *)&part;
    const real body = pbr_body(&part);
    part.base_color = color_scale(part.base_color, body);
    m->body += share * body;
    for (int i = 0; i < WEIGHED_PARTS; ++i) {
        const int first = WEIGHED[i][0];
        const real weight = LEAST_WEIGHT + numbers[first];
        for (int n = first + 1; n <= first + WEIGHED[i][1]; ++n) numbers[n] *= weight;
        m->weights[i] += share * weight;
    }
    for (int n = 0; n < NUMBERS_OF(pbr); ++n) ((real *)&m->sum)[n] += share * numbers[n];
}

// (Lanes that have no material at all have no weights.)
INLINE pbr pbr_mixed(pbr_mix m) {
    real *numbers = (real *)&m.sum;
    m.sum.base_color = color_scale(m.sum.base_color, R(1.0) / fmax(m.body, R(1e-6)));
    for (int i = 0; i < WEIGHED_PARTS; ++i) {
        const int first = WEIGHED[i][0];
        const real each = R(1.0) / fmax(m.weights[i], R(1e-6));
        for (int n = first + 1; n <= first + WEIGHED[i][1]; ++n) numbers[n] *= each;
    }
    return m.sum;
}

// One of the materials that have layers, with its maps.
CALLED pbr pbr_mapped(stage s, const interaction *here, int number, world w) {
    __constant const struct Pbr *material = w.materials + number;
    pbr p = pbr_of(material, here->tint);
    real *numbers = (real *)&p;
    for (int i = 0; i < material->map_count; ++i) {
        map_record m = w.maps + material->first_map + i;
        const color found = map_at(s, here, AT_INTERACTION, m, w);
        numbers[m->number] = found.r;
        if (m->count < 3) continue;
        numbers[m->number + 1] = found.g;
        numbers[m->number + 2] = found.b;
    }
    p.bending_ior = p.specular_ior;
    // Of a blend's parts what they reflect and shine is mixed, not the factors of it.
    p.base_color = color_scale(p.base_color, p.base_weight);
    p.emission_color = color_scale(p.emission_color, p.emission_luminance);
    p.base_weight = p.emission_luminance = R(1.0);
    return p;
}

CALLED pbr pbr_at(stage s, const interaction *here, world w) {
    if (w.settings->material_count == 1 && w.materials->map_count == 0) return pbr_of(w.materials, here->tint);
    if (w.settings->material_count == 1) return pbr_mapped(s, here, 0, w);
    // The share of each material. Blends come before their parts, and pass theirs on to them.
    real shares[MOST_MATERIALS];
    const real root = interaction_material(here, w);
    for (int i = 0; i < w.settings->material_count; ++i) shares[i] = pick(equal(root, (real)((scalar)i)), R(1.0), R(0.0));
    pbr_mix mix = {0};
    for (int i = 0; i < w.settings->material_count; ++i) {
        if (!any_of(shares[i])) continue;
        __constant const struct Pbr *material = w.materials + i;
        if (material->blend[0] >= 0) {
            const real second = map_at(s, here, AT_INTERACTION, w.maps + material->mask, w).r;
            shares[material->blend[0]] += shares[i] * (R(1.0) - second);
            shares[material->blend[1]] += shares[i] * second;
            continue;
        }
        pbr_add(&mix, pbr_mapped(s, here, i, w), shares[i]);
    }
    pbr sum = pbr_mixed(mix);
    sum.base_weight = sum.emission_luminance = R(1.0);
    return sum;
}

// The face of a cut is a matt body in the plane's colours (Lambert's), whatever has been cut; but for planes that have a material, and for
// what light goes into, of which it is a boundary like any other.
INLINE void pbr_of_face(const interaction *here, pbr *p, world w) {
    mask face = on_face(here);
    const real plane = plane_of_face(here->object), cut = thing_cut(here->object);
    for (int i = 0; i < w.planes.count; ++i) {
        if (w.planes.planes[i].material >= 0) face &= ~equal(plane, (real)((scalar)i));
    }
    face &= ~(of_the_set(cut, w) & is_set_body(body_of_thing(cut, w), w));
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (w.objects[i].glass) face &= ~equal(cut, (real)((scalar)(i + 1)));
    }
    const real one = R(1.0);
    pbr matt = *p;
    pbr_matt(&matt);
    matt.base_weight = one;
    matt.base_color = color_of(fmin(here->tint.r, one), fmin(here->tint.g, one), fmin(here->tint.b, one));
    *p = pbr_pick(face, matt, *p);
}

// What a path meets at an interaction: a thing's material, where two solids flow together a blend of theirs, or the face of a cut.
INLINE pbr pbr_found(stage s, const interaction *here, world w) {
    pbr p = pbr_at(s, here, w);
    const mask flows = less(R(0.0), here->share);
    if (any_lane(flows)) {
        interaction one = *here, other = one;
        const real quantity = is_colored_at_once(w.material) ? here->smooth : here->quantity;
        other.object = here->other;
        one.share = other.share = R(0.0);
        one.tint = object_color(here->normal, quantity, one.object, w);
        other.tint = object_color(here->normal, quantity, other.object, w);
        pbr_mix mix = {0};
        pbr_add(&mix, pbr_at(s, &one, w), R(1.0) - here->share);
        pbr_add(&mix, pbr_at(s, &other, w), here->share);
        // (A blend of one material alone is not that material to the last bit. A single lane that is here has two.)
        p = LANES == 1 ? pbr_mixed(mix) : pbr_pick(flows, pbr_mixed(mix), p);
    }
    if (any_lane(on_face(here))) pbr_of_face(here, &p, w);
    return p;
}
