// The escape of points of a plane through several solids that are joined, in the place of `escape.h`: counts are the largest of
// what is beside each other, and the smaller of both where only what they have in common is left.
#include "escape_types.h"

// A formula has its own limit, unless the plane has one.
INLINE escaped one_escape(vec own, mask active, int smooth, int periodicity, int limit, __constant const struct Orbit *o,
                          __constant const scalar *k) {
    escaped one = {R(0.0), active & ~active, R(0.0)};
    if (o->kind != SOLID_FORMULA) {
        solid_found found;
        solid_simple(o, own, &found);
        one.inside = active & found.inside;
        return one;
    }
#define ESCAPE_TEXT(i) case i: one = plane_escape_##i(own, active, smooth, periodicity, limit, o, k + o->first); break;
    switch (o->text) { EACH_TEXT(ESCAPE_TEXT) }
    return one;
}

CALLED escaped solids_escape(const vec *point, mask active, int smooth, int periodicity, int most,
                             __constant const struct Orbit *orbit, __constant const scalar *k) {
    const real limit = (real)((scalar)most);
    escaped all = {R(0.0), active & ~active, R(0.0)};
    for (int i = 0; i < SOLIDS; ++i) {
        __constant const struct Orbit *o = orbit + i;
        const int own = most == orbit->iterations ? o->iterations : most;
        const escaped one = one_escape(solid_own(o, *point), active, smooth, periodicity, own, o, k);
        const real count = pick(one.inside, limit, fmin(one.count, limit));
        all.applications += one.applications;
        if (o->join == JOIN_CUT) {
            all.inside &= ~one.inside;
            all.count = pick(one.inside, R(0.0), all.count);
        } else if (o->join == JOIN_INTERSECTION) {
            all.inside &= one.inside;
            all.count = fmin(all.count, count);
        } else {
            all.inside |= one.inside;
            all.count = fmax(all.count, count);
        }
    }
#if JOINS_SMOOTHLY
    all.inside |= solids_inside(point, active, most, orbit, k).inside;
    all.count = pick(all.inside, limit, all.count);
#endif
    return all;
}

INLINE escaped plane_escape(vec point, mask active, int smooth, int periodicity, int most, __constant const struct Orbit *orbit,
                            __constant const scalar *k) {
    return solids_escape(&point, active, smooth, periodicity, most, orbit, k);
}
