// Light that an interaction sends along a path, and what a path has seen at its end.

// The light that one light ray adds, for every normal of the interaction.
INLINE color lit_by(stage s, const interaction *here, incidence in, mask lit, real open, vec to_viewer,
                    light_record light, phong_material l, world w) {
    color sum = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < facet_count(s.bounce, w); ++i) {
        const facet f = facet_of(s, here, i, w);
        const color one = shaded(here->tint, f.normal, to_viewer, in, lit, open, light, l, w);
        sum = color_add(sum, color_scale(one, f.weight));
    }
    return sum;
}

// The light of lights without a size.
INLINE color light_gathered(stage s, const interaction *here, vec to_viewer, counters *cost, world w) {
    color gathered = color_of(R(0.0), R(0.0), R(0.0));
    const phong_material l = phong_material_of(here, w);
    for (int turn = 0; turn < w.settings->light_count; ++turn) {
        light_record light = w.lights + turn;
        const ray_hit met = queue_met(s.q, turn, s.slot);
        counters_met(cost, met, 0);
        incidence in = light_at(light, here->point, w.tables);
        in.toward = queue_ray(s.q, turn, s.slot).direction;
        const color more = lit_by(s, here, in, ~mask_of(met.hit), R(1.0), to_viewer, light, l, w);
        gathered = color_add(gathered, color_scale(more, (real)(light->share)));
    }
    return color_add(gathered, l.emission);
}

// The first thing that the eye sees here is a light, or a medium: an interaction for depth and coverage, without light of others. `object`: -1
// for a light, or the number of the medium's.
INLINE void interaction_of_light(stage s, interaction *found, vec origin, vec direction, real far, real object, mask met) {
    if (!any_lane(met) || s.bounce > 0) return;
    STATE_KEPT(s, sighting, first, STATE_SIGHTING);
    first.coverage = pick(met, R(1.0), first.coverage);
    STATE_KEEP(s, first, STATE_SIGHTING);
    found->found = pick(met, R(1.0), found->found);
    found->point = vec_pick(met, vec_along(origin, far, direction), found->point);
    found->seen = vec_pick(met, found->point, found->seen);
    found->normal = vec_pick(met, vec_scale(direction, R(-1.0)), found->normal);
    found->smooth = pick(met, R(0.0), found->smooth);   // no march has written one
    found->object = pick(met, object, found->object);
    found->share = pick(met, R(0.0), found->share);
    interaction_keep(s, found, 0);
}

// A path that has met a light before the surface ends there.
INLINE void path_ends_at_light(stage s, path *so_far) {
    STATE_KEPT(s, light_before, there, STATE_LIGHT_BEFORE);
    const mask met = mask_of(there.met);
    so_far->seen = color_pick(met, color_add(so_far->seen, color_mul(there.shows, so_far->through)), so_far->seen);
    so_far->on_path = number_of(mask_of(so_far->on_path) & ~met);
}

// Adds the light of the path's present interaction, or of the sky past it, to what the path has seen.
INLINE void path_add(stage s, path *so_far, vec direction, real picture_y, const interaction *here, color gathered, color mirrored,
                      int last, world w) {
    mask on_path = mask_of(so_far->on_path);
    const mask found = mask_of(here->found);
    if (s.bounce > 0) {
        path_sees(s, so_far, color_mul(sky(direction, picture_y, 1, w), so_far->through), on_path & ~found, w);
    }
    on_path &= found;
    color own = color_of(R(1.0), R(1.0), R(1.0));
    if (!last) own = color_of(R(1.0) - mirrored.r, R(1.0) - mirrored.g, R(1.0) - mirrored.b);
    path_sees(s, so_far, color_mul(gathered, color_mul(so_far->through, own)), on_path, w);
    so_far->on_path = number_of(on_path);
}

// Goes on along the mirrored ray.
INLINE void path_mirror(stage s, path *so_far, vec direction, ray from_eye, real time, const interaction *here, color mirrored, world w) {
    interaction seen_first = *here;
    if (s.bounce > 0) seen_first = interaction_kept(s, 0);
    so_far->through = color_mul(so_far->through, mirrored);
    so_far->origin = vec_along(here->point, lift_of(here, w), here->normal);
    so_far->direction = vec_along(direction, R(-2.0) * vec_dot(direction, here->normal), here->normal);
    so_far->footprint = here->cone;
    so_far->spread = from_eye.spread + (from_eye.footprint / fmax(depth_of(seen_first.seen, time, w.view), here->cone));
    // What mirrors nothing sends no ray.
    so_far->on_path = number_of(mask_of(so_far->on_path) & less(R(0.0), brightest(so_far->through)));
    STATE_KEEP(s, *so_far, STATE_PATH);
    ray r = {so_far->origin, so_far->direction, R(0.0), (real)(REAL_LARGEST), so_far->footprint, so_far->spread,
             RAY_NOTHING_KNOWN};
    send_clipped(s, 0, r, R(0.0), WHICH, mask_of(so_far->on_path), w);
}
