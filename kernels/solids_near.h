// How near the orbit of a point comes to a trap, under the formula that is nearest to the point.
INLINE real orbit_near(trap near, vec point, mask active, __constant const struct Orbit *orbit, __constant const scalar *k) {
    surface_point nearest;
    solids_distance(&point, active, ASK_ESTIMATE, orbit, k, &nearest);
    real found = (real)(REAL_LARGEST);
    for (int i = 0; i < SOLIDS; ++i) {
        __constant const struct Orbit *o = orbit + i;
        const mask here = active & equal(nearest.of, (real)((scalar)i));
        if (o->kind != SOLID_FORMULA || !any_lane(here)) continue;
        real one = found;
#define NEAR_TEXT(i) case i: one = orbit_near_##i(near, solid_own(o, point), here, o, k + o->first); break;
        switch (o->text) { EACH_TEXT(NEAR_TEXT) }
        found = pick(here, one, found);
    }
    return found;
}
