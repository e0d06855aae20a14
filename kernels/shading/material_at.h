// The material of an interaction: what paths scatter by.
NUMBERS_PICKED(pbr)

// Materials are mixed by the shares that they have in an interaction. A colour counts by the light that it colours: that of a body which a
// medium hides counts for nothing.
typedef struct {
    pbr sum;
    real body, medium;   // how much of the light meets the bodies and the media of all parts
} pbr_mix;

// Scales what only the light that meets the body, and the medium, is coloured by.
INLINE void pbr_weigh(pbr *p, real body, real medium) {
    p->base_color = color_scale(p->base_color, body);
    p->subsurface_color = color_scale(p->subsurface_color, medium);
    p->subsurface_radius *= medium;
}

INLINE void pbr_add(pbr_mix *m, pbr part, real share, world w) {
    if (HAS(w, SUBSURFACE)) {
        const real medium = part.subsurface_weight, body = R(1.0) - medium * (R(1.0) - part.base_metalness);
        pbr_weigh(&part, body, medium);
        m->body += share * body;
        m->medium += share * medium;
    }
    for (int i = 0; i < NUMBERS_OF(pbr); ++i) ((real *)&m->sum)[i] += share * ((const real *)&part)[i];
}

INLINE pbr pbr_mixed(pbr_mix m, world w) {
    if (HAS(w, SUBSURFACE)) pbr_weigh(&m.sum, R(1.0) / fmax(m.body, R(1e-6)), R(1.0) / fmax(m.medium, R(1e-6)));
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
        pbr_add(&mix, pbr_mapped(s, here, i, w), shares[i], w);
    }
    pbr sum = pbr_mixed(mix, w);
    sum.base_weight = sum.emission_luminance = R(1.0);
    return sum;
}

// The face of a cut is a matt body in the plane's colours (Lambert's), whatever has been cut.
INLINE void pbr_of_face(const interaction *here, pbr *p) {
    const mask face = on_face(here);
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
        pbr_add(&mix, pbr_at(s, &one, w), R(1.0) - here->share, w);
        pbr_add(&mix, pbr_at(s, &other, w), here->share, w);
        // (A blend of one material alone is not that material to the last bit. A single lane that is here has two.)
        p = LANES == 1 ? pbr_mixed(mix, w) : pbr_pick(flows, pbr_mixed(mix, w), p);
    }
    if (any_lane(on_face(here))) pbr_of_face(here, &p);
    return p;
}
