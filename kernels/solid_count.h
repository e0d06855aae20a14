// Smooth escape counts as `orbit_dual_distance` and `smooth_count` find them, without derivatives; and which points are inside.
INLINE real solid_count(vec point, mask *within, __constant const struct Orbit *orbit, __constant const scalar *k) {
    state c, z;
    start(point, k, &c, &z);
    surface_point end;
    end.square = state_square(z);
    end.square_before = end.square;
    real count = (real)((scalar)FIRST_COUNT);
    mask alive = less_equal(end.square, (real)(orbit->distance_square));
    mask inside = alive & ~alive;
    for (int n = FIRST_COUNT; n < orbit->longest; ++n) {
        if (n == orbit->iterations) {
            inside = alive & settled(end.square, orbit);
            alive &= ~inside;
        }
        if (!any_lane(alive)) break;
        const state next = apply(n, z, c, k);
        z = state_pick(alive, next, z);
        end.square_before = pick(alive, end.square, end.square_before);
        end.square = pick(alive, state_square(next), end.square);
        count = pick(alive, (real)((scalar)(n + 1)), count);
        alive &= less_equal(end.square, (real)(orbit->distance_square));
    }
    if (orbit->longest <= orbit->iterations) inside |= alive & settled(end.square, orbit);
#if HAS_SHAPE
    inside = less_equal(solid_distance(z, k), R(0.0));
#endif
    const orbit_end found = {count, inside};
    *within = inside;
    return clamp(smooth_count(found, end, orbit), R(0.0), (real)((scalar)orbit->iterations));
}
