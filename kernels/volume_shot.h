// One sample of a volume's pixel: the ray through the grid, and the planes in the picture.

#if PLANES > 0
// The plane at which a ray begins, or -1 where it begins outside the grid.
INLINE real in_grid(ray r, real face, __constant const struct Grid *about) {
    const vec p = grid_own(about, vec_sub(vec_along(r.origin, r.near, r.direction), vec_splat(about->corner)));
    const mask inside = less_equal(R(0.0), fmin(p.x, fmin(p.y, p.z))) & less_equal(p.x, (real)((scalar)about->sides[0])) &
                        less_equal(p.y, (real)((scalar)about->sides[1])) & less_equal(p.z, (real)((scalar)about->sides[2]));
    return pick(inside, face, R(-1.0));
}
#endif

// What is behind all.
INLINE color background_of(real y, world w) {
    if (w.material->transparent) return color_of(R(0.0), R(0.0), R(0.0));
    const real share = clamp(y / (real)((scalar)w.view->height), R(0.0), R(1.0));
    return color_mix(color_splat(w.material->background_top), color_splat(w.material->background_bottom), share);
}

INLINE shot take_shot(real x, real y, real lens_x, real lens_y, real time, mask wanted, world w, real *steps) {
    const ray r = camera_ray(x, y, lens_x, lens_y, time, w.view);
    const vec to_viewer = vec_scale(r.direction, R(-1.0));
    ray kept = r;
    mask active = wanted;
#if PLANES > 0
    // Where a cutting plane opens the set, its face is visible.
    real face, face_count = R(0.0);
    color face_tint = color_of(R(0.0), R(0.0), R(0.0));
    vec face_normal = to_viewer;
    active &= planes_cut(&kept, &face, w.planes);
    const mask bare = planes_face(kept, in_grid(kept, face, w.grid.about), active, w.planes, &face_tint, &face_normal, &face_count);
    active &= ~bare;
#endif
    grid_ray g;
    active &= enter(kept, w, &g);
    const mask nowhere = active & ~active;
    real looked = R(0.0);
    sight e = {color_of(R(0.0), R(0.0), R(0.0)), R(1.0), R(0.0), R(0.0), vec_of(R(0.0), R(0.0), R(0.0)), nowhere, nowhere, nowhere};
    quads q = quads_ahead(r, wanted, w);
    sight_grid(&e, r, g, active, to_viewer, &q, w, &looked);
#if PLANES > 0
    sight_quads(&e, kept.near, bare, &q, w);
    sight_add(&e, face_tint, R(1.0), kept.near, face_count, face_normal, bare, bare);
    sight_quads(&e, (real)(REAL_LARGEST), wanted, &q, w);
#endif
    const color background = background_of(y, w);
    shot s;
    s.coverage = R(1.0) - e.through;
    s.hit = e.found;
    s.radiance = color_add(e.light, color_scale(background, e.through));
    s.point = vec_along(r.origin, e.t, r.direction);
    s.depth = depth_of(s.point, time, w.view);
    s.normal = e.normal;
    s.smooth = pick(e.on_plane, e.value, e.value * (real)(w.settings->value_scale) + (real)(w.settings->value_offset));
    s.steps = looked;
    *steps += looked;
#if PLANES > 0 && SURFACE
    const real distance = pick(s.hit, e.t, (real)(REAL_LARGEST));
    s = planes_into(s, e.light, background, planes_seen(r, distance, R(-1.0), wanted, w.planes), time, w.view);
#endif
    return s;
}
