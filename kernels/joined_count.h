// Counts of several solids that are joined, in the place of `solid_count.h`: the largest of those that are beside each other, the
// smaller of both where only what they have in common is left. A simple solid has the iteration limit inside, and 0 outside. What is
// cut out has counts of 0, and does not change others.
INLINE real solid_count(vec point, mask *within, __constant const struct Orbit *orbit, __constant const scalar *k) {
    const real most = (real)((scalar)orbit->iterations);
    real all = R(0.0);
    for (int i = 0; i < SOLIDS; ++i) {
        __constant const struct Orbit *o = orbit + i;
        const vec own = solid_own(o, point);
        real count = R(0.0);
        mask inside;
        if (o->kind != SOLID_FORMULA) {
            solid_found found;
            solid_simple(o, own, &found);
            inside = found.inside;
        } else {
#define COUNT_TEXT(i) case i: count = solid_count_##i(own, &inside, o, k + o->first); break;
            switch (o->text) { EACH_TEXT(COUNT_TEXT) }
        }
        // Each formula has a limit of its own.
        count = pick(inside, most, fmin(count, most));
        if (o->join == JOIN_CUT) all = pick(inside, R(0.0), all);
        else if (o->join == JOIN_INTERSECTION) all = fmin(all, count);
        else all = fmax(all, count);
    }
#if JOINS_SMOOTHLY
    surface_point ignored;
    all = pick(solids_distance(&point, equal(R(0.0), R(0.0)), ASK_STEP, orbit, k, &ignored).end.inside, most, all);
#endif
    *within = less_equal(most, all);
    return all;
}
