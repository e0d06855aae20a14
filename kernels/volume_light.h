// The light of a place in a grid.
#if HAS_SHADOWS
// The part of a light that gets through to a point.
INLINE real light_through(vec point, vec normal, vec toward, real distance, mask active, world w, real *steps) {
    ray r;
    r.origin = vec_along(point, (real)(w.settings->shadow_lift), normal);
    r.direction = toward;
    r.near = R(0.0);
    r.far = distance;
#if PLANES > 0
    real side;
    active &= planes_cut(&r, &side, w.planes);
#endif
    grid_ray g;
    active &= enter(r, w, &g);
    real number = R(0.0), through = R(1.0);
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (!any_lane(active)) break;
        cell c;
        ints entry;
        real onward;
        const mask seen = look(g, number, &active, w, &c, &entry, &onward, steps);
        if (any_lane(seen)) {
            onward = pick(seen, number + R(1.0), onward);
            const real value = grid_value(c, entry, seen, w.grid);
#if SURFACE
            through = pick(seen & less((real)(w.settings->level), value), R(0.0), through);
#else
            through = pick(seen, through * (R(1.0) - opacity_of(value, w)), through);
#endif
            active &= less(R(1.0) - (real)(w.settings->opacity_limit), through);
        }
        number = onward;
    }
    return through;
}
#endif

// The light that a place of the grid sends to the viewer.
INLINE color lit(vec point, vec normal, color tint, vec to_viewer, mask active, world w, real *steps) {
    color sum = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < w.settings->light_count; ++i) {
        __constant const struct Light *light = w.lights + i;
        const incidence in = light_at(light, point);
        const mask all_lanes = equal(R(0.0), R(0.0));
        const color open = phong(tint, normal, to_viewer, in, all_lanes, R(1.0), light, w.material);
#if HAS_SHADOWS
        real share = R(1.0);
        const mask facing = active & less(R(0.0), vec_dot(normal, in.toward));
        if (light->shadow && any_lane(facing)) share = light_through(point, normal, in.toward, in.distance, facing, w, steps);
        const color dark = phong(tint, normal, to_viewer, in, ~all_lanes, R(1.0), light, w.material);
        sum = color_add(sum, color_mix(dark, open, share));
#else
        sum = color_add(sum, open);
#endif
    }
    return sum;
}

// A place without a normal faces the viewer, and so does the far side of what is transparent.
INLINE vec facing_normal(vec normal, vec to_viewer) {
    const mask none = less(vec_dot(normal, normal), R(0.5));
    const mask away = less(vec_dot(normal, to_viewer), R(0.0));
    return vec_pick(none, to_viewer, vec_pick(away, vec_scale(normal, R(-1.0)), normal));
}
