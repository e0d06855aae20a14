// How near the orbit of a point comes to a trap, under the formula that is nearest to the point; where two flow together, between theirs.
INLINE real orbit_near(trap near, vec point, mask active, __constant const struct Orbit *orbit, __constant const scalar *k) {
    surface_point nearest;
    solids_distance(&point, active, ASK_ESTIMATE, orbit, k, &nearest);
    real found = (real)(REAL_LARGEST), other = found;
    mask told = active & ~active, other_told = told;
    for (int i = 0; i < SOLIDS; ++i) {
        __constant const struct Orbit *o = orbit + i;
        const real number = (real)((scalar)i);
        mask here = active & equal(nearest.of, number), beside = here & ~here;
#if JOINS_SMOOTHLY
        beside = active & less(R(0.0), nearest.share) & equal(nearest.other_of, number);
#endif
        if (o->kind != SOLID_FORMULA || !any_lane(here | beside)) continue;
        real one = found;
#define NEAR_TEXT(i) case i: one = orbit_near_##i(near, solid_own(o, point), here | beside, o, k + o->first); break;
        switch (o->text) { EACH_TEXT(NEAR_TEXT) }
        found = pick(here, one, found);
        other = pick(beside, one, other);
        told |= here;
        other_told |= beside;
    }
#if JOINS_SMOOTHLY
    found = shared(found, other, told, other_told, nearest.share);
#endif
    return found;
}
