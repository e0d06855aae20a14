// What is asked of the orbit of a point: how near it comes to a trap, or a number that goes on beside z. The shape of a trap is a file
// of `elements/traps` with this function:
//   real NAME_away(vec offset, vec direction, real radius)     how far the place is whose offset from the centre this is
typedef struct {
    int shape;
    vec center, direction;
    real radius;
} trap;

#include "elements/traps"

// From the first three variables of z to the trap.
#define AWAY(KIND, name) case TRAP_##KIND: return name##_away(offset, near.direction, near.radius);
INLINE real trap_distance(trap near, state z) {
    const vec offset = vec_sub(vec_of(z.s0, z.s1, z.s2), near.center);
    switch (near.shape) { TRAPS(AWAY) default: return (real)(REAL_LARGEST); }
}

// How near z comes to the trap before an orbit begins: all are where the place's own is. Where it begins counts, too, unless that is at its
// point, before any application.
#ifdef SHOWS_PLACE
INLINE real told_before(trap near, state z, orbit_record orbit, constants k) {
    const int table = placed_table(k), own = table + (int)k[table + 4], first = (int)k[table + 5];
    const real none = (real)(REAL_LARGEST);
    real nearest = pick(less(R(0.0), z.begun), trap_distance(near, z), none);
    state past = z;
    for (int n = max(first, 1); any_lane(less((real)((scalar)n), z.begun)); ++n) {
        __constant const scalar *at = k + own + (n - first) * STATE_SIZE;
        past.s0 = at[0];
        past.s1 = at[1];
        past.s2 = at[2];
        nearest = pick(less((real)((scalar)n), z.begun), fmin(nearest, trap_distance(near, past)), nearest);
    }
    return nearest;
}
#else
INLINE real told_before(trap near, state z, orbit_record orbit, constants k) {
    return FIRST_COUNT > 0 ? trap_distance(near, z) : (real)(REAL_LARGEST);
}
#endif

// The smallest distance of z from the trap after one application or more, the one that leaves the bailout included; or, where `carried`
// is the number of a name, the number beside z of that name after the last of them. An orbit that is outside from the start has only its
// start.
INLINE real formula_told(trap near, int carried, vec point, mask active, orbit_record orbit, constants k) {
    state c, z;
    start(point, k, &c, &z);
    const real at_start = trap_distance(near, z);
    const int first = ORBIT_FIRST(z, active);
    real nearest = told_before(near, z, orbit, k);
    mask alive = active & less_equal(state_square(z), (real)(orbit->bailout_square));
    for (int n = first; n < orbit->iterations; ++n) {
        if (!any_lane(alive)) break;
        const state next = apply(n, z, c, k);
        const mask applied = going_on(alive);
        z = state_pick(applied, next, z);
        if (!carried) nearest = pick(applied, fmin(nearest, trap_distance(near, next)), nearest);
        alive = applied & less_equal(state_square(z), (real)(orbit->bailout_square));
    }
#if CARRIES_NUMBERS
    if (carried) return carried_number(carried, z, k);
#endif
    return pick(less(nearest, (real)(REAL_LARGEST)), nearest, at_start);
}

// The same under the formula that is nearest to the point; where two flow together, between theirs.
INLINE real orbit_told(trap near, int carried, vec point, mask active, orbit_record orbit, constants k) {
    if (!JOINED) return formula_told(near, carried, point, active, orbit, k);
    surface_point nearest;
    solids_distance(&point, active, ASK_ESTIMATE, orbit, k, &nearest);
    real found = (real)(REAL_LARGEST), other = found;
    mask known = active & ~active, other_known = known;
    for (int i = 0; i < orbit->solids; ++i) {
        orbit_record o = orbit + i;
        const real number = (real)((scalar)i);
        const mask here = active & equal(nearest.own.of, number);
        const mask beside = active & less(R(0.0), nearest.share) & equal(nearest.other.of, number);
        if (o->kind != SOLID_FORMULA || !any_lane(here | beside)) continue;
        const real one = formula_told(near, carried, solid_own(o, point), here | beside, o, k + o->first);
        found = pick(here, one, found);
        other = pick(beside, one, other);
        known |= here;
        other_known |= beside;
    }
    return shared(found, other, known, other_known, nearest.share);
}

// How near the orbit of a point comes to a trap.
INLINE real orbit_near(trap near, vec point, mask active, orbit_record orbit, constants k) {
    return orbit_told(near, 0, point, active, orbit, k);
}
