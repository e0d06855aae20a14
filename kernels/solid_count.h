// Smooth escape counts as `formula_dual_distance` and `formula_smooth_count` find them, without derivatives; and which points are inside.
INLINE real formula_count(vec point, mask *within, orbit_record orbit, constants k) {
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
    if (HAS_SHAPE) inside = less_equal(solid_distance(z, k), R(0.0));
    const orbit_end found = {count, inside};
    *within = inside;
    return clamp(formula_smooth_count(found, end, orbit), R(0.0), (real)((scalar)orbit->iterations));
}

// Counts of several solids that are joined: the largest of those that are beside each other, the
// smaller of both where only what they have in common is left. A simple solid has the iteration limit inside, and 0 outside. What is
// cut out has counts of 0, and does not change others.
INLINE real solid_count(vec point, mask *within, orbit_record orbit, constants k) {
    if (!JOINED) return formula_count(point, within, orbit, k);
    const real most = (real)((scalar)orbit->iterations);
    real all = R(0.0);
    for (int i = 0; i < orbit->solids; ++i) {
        orbit_record o = orbit + i;
        const vec own = solid_own(o, point);
        real count = R(0.0);
        mask inside;
        if (o->kind != SOLID_FORMULA) inside = simple_holds(o, own);
        else count = formula_count(own, &inside, o, k + o->first);
        // Each formula has a limit of its own.
        count = pick(inside, most, fmin(count, most));
        if (o->join == JOIN_CUT) all = pick(inside, R(0.0), all);
        else if (o->join == JOIN_INTERSECTION) all = fmin(all, count);
        else all = fmax(all, count);
    }
    if (orbit->flows) {
        surface_point ignored;
        all = pick(solids_distance(&point, equal(R(0.0), R(0.0)), ASK_STEP, orbit, k, &ignored).end.inside, most, all);
    }
    *within = less_equal(most, all);
    return all;
}
