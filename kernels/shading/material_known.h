// The material of an interaction, as paths scatter by it: that of its thing, or what `find_materials` has found out.

INLINE pbr pbr_of_interaction(stage s, const interaction *here, world w) {
    pbr p;
    if (KEEPS(s, STATE_MATTER)) {
        matter_recall(s, &p);
        return p;
    }
    const color tint = is_colored_at_once(w.material) ? here->tint : tint_of(here, w);
    p = pbr_of(w.materials, tint);
    const real own = interaction_material(here, w);
    for (int i = 1; i < w.settings->material_count; ++i) {
        const mask has = equal(own, (real)((scalar)i));
        if (!any_lane(has)) continue;
        const pbr other = pbr_of(w.materials + i, tint);
        for (int n = 0; n < NUMBERS_OF(pbr); ++n) ((real *)&p)[n] = pick(has, ((const real *)&other)[n], ((real *)&p)[n]);
    }
    return p;
}

// Of the way that a surface faces the viewer, what is left at least by slopes that turn it from him.
#define LEAST_FACING R(0.1)

// The normal of an interaction's relief, length 1; `inside`: where the viewer, and so the interaction's normal, is in the set. Slopes that
// would turn the surface away from the viewer are lowered until it faces him.
INLINE vec bumped_normal(stage s, const interaction *here, mask inside, vec to_viewer) {
    STATE_KEPT(s, relief, known, STATE_RELIEF);
    const mask rises = mask_of(known.rises);
    vec slope = vec_scale(known.slope, pick(inside, R(-1.0), R(1.0)));
    const real facing = vec_dot(here->normal, to_viewer), turned = vec_dot(slope, to_viewer);
    const real most_turned = (R(1.0) - LEAST_FACING) * fmax(facing, R(0.0));
    slope = vec_scale(slope, pick(less(most_turned, turned), most_turned / turned, R(1.0)));
    const vec leaning = vec_normalize(vec_sub(here->normal, slope));
    const mask usable = rises & less(R(0.0), facing) & less(R(0.5), vec_dot(leaning, leaning));
    return vec_pick(usable, leaning, here->normal);
}

// About what a material reflects of white light, from wherever it comes and is looked at: what channels call albedo. A clear boundary
// counts as nothing, since what it does not mirror comes back from the body.
INLINE color pbr_albedo(const pbr *p, __global const float *tables) {
    const color white = color_of(R(1.0), R(1.0), R(1.0));
    const color body = color_mix(color_scale(p->base_color, p->base_weight), p->subsurface_color, p->subsurface_weight);
    const color base = color_mix(body, white, p->transmission_weight * (R(1.0) - p->base_metalness));
    const color below = color_mul(base, color_mix(white, p->coat_color, p->coat_weight));
    const real fibres = p->fuzz_weight * albedo_at(tables + ALBEDO_FUZZ, R(0.5), fmax(p->fuzz_roughness, SMOOTHEST_FUZZ)).mean;
    return color_mix(below, p->fuzz_color, fibres);
}
