// Normals of the surface in a grid of a formula: the formula's own, which the grid only says where to look for.
//
// What is blended of eight samples is off by how the surface bends within a cell (0.2 degrees where details are some voxels wide), and
// where a cell holds two sheets by more.
#define NORMAL_STEPS 12    // places at which the surface's other side is looked for, an eighth of a voxel apart: rough ones have threads
#define FIRST_HALVINGS 2   // of the last of these parts, in the look that only has to find a better direction ...
#define LAST_HALVINGS 8    // ... and in the last one: 1/2048 of a voxel

// The normal of the solid's surface where a line from a place along `line`, to the side on which the surface is, first passes it. Lanes
// that find none within reach are active no longer.
INLINE vec normal_along(vec from, vec line, int halvings, mask *active, world w) {
    const real step = (real)(w.settings->normal_step);
    const int limit = w.orbits->iterations;
    const mask began = orbit_inside(from, *active, limit, w.orbits, w.k);
    const vec way = vec_pick(began, line, vec_scale(line, R(-1.0)));
    // A bracket: `past` is on the other side of the surface, and `before` is not.
    real before = R(0.0), past = R(0.0);
    mask found = *active & ~*active;
    for (int i = 0; i < TURNS(NORMAL_STEPS); ++i) {
        const mask asked = *active & ~found;
        if (!any_lane(asked)) break;
        before = pick(asked, past, before);
        past += pick(asked, step, R(0.0));
        found |= asked & (began ^ orbit_inside(vec_along(from, past, way), asked, limit, w.orbits, w.k));
    }
    for (int i = 0; i < halvings; ++i) {
        if (!any_lane(found)) break;
        const real middle = R(0.5) * (before + past);
        const mask passed = began ^ orbit_inside(vec_along(from, middle, way), found, limit, w.orbits, w.k);
        past = pick(passed, middle, past);
        before = pick(passed, before, middle);
    }
    surface_point surface;
    orbit_dual_distance(vec_along(from, pick(began, past, before), way), found, OF_SURFACE, w.orbits, w.k, &surface);
    const vec normal = vec_normalize(surface.gradient);
    *active = found & less(R(0.5), vec_dot(normal, normal));
    return normal;
}

// The normal of the solid's surface where it is nearest to a place that a ray has met; that which is blended where it has none near. The
// first look goes along that one, the second along what the first has found.
INLINE vec exact_normal(vec point, vec blended, mask active, world w) {
    const vec from = vec_along(vec_splat(w.settings->zoom_origin), (real)(w.settings->zoom), point);
    vec normal = blended;
    for (int i = 0; i < TURNS(2); ++i) {
        if (!any_lane(active)) break;
        const vec found = normal_along(from, normal, i == 0 ? FIRST_HALVINGS : LAST_HALVINGS, &active, w);
        normal = vec_pick(active, found, normal);
    }
    return normal;
}
