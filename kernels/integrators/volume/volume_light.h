// The light of a place in a grid.

// What part of it comes through a place that a ray looks at.
INLINE real part_through(real value, world w);

// The part of a light that gets through to a point.
INLINE real light_through(vec point, vec normal, vec toward, real distance, mask active, world w, real *steps) {
    ray r = {.origin = vec_along(point, (real)(w.settings->shadow_lift), normal), .direction = toward, .far = distance};
    active &= planes_leave(&r, w);
    grid_ray g;
    active &= enter(r, w, &g);
    real number = R(0.0), through = R(1.0);
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (!any_lane(active)) break;
        real value;
        const mask seen = look(g, number, &active, w, &value, &number, steps);
        if (!any_lane(seen)) continue;
        through = pick(seen, through * part_through(value, w), through);
        active &= less(R(1.0) - (real)(w.settings->opacity_limit), through);
    }
    return through;
}

// The light that a place of the grid sends to the viewer.
INLINE color lit(vec point, vec normal, color tint, vec to_viewer, mask active, world w, real *steps) {
    color sum = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < w.settings->light_count; ++i) {
        light_record light = w.lights + i;
        const incidence in = light_at(light, point, w.tables);
        const mask all_lanes = equal(R(0.0), R(0.0));
        const color open = phong(tint, normal, to_viewer, in, all_lanes, R(1.0), light, w.material);
        if (!w.settings->shadows) {
            sum = color_add(sum, open);
            continue;
        }
        real share = R(1.0);
        const mask facing = active & less(R(0.0), vec_dot(normal, in.toward));
        if (light->shadow && any_lane(facing)) share = light_through(point, normal, in.toward, in.distance, facing, w, steps);
        const color dark = phong(tint, normal, to_viewer, in, ~all_lanes, R(1.0), light, w.material);
        sum = color_add(sum, color_mix(dark, open, share));
    }
    return sum;
}
