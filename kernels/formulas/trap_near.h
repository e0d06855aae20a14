// How near the orbit of a point comes to a trap. Its shape is a file of `elements/traps` with this function:
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

// How near z comes to a trap after one application or more, the one that leaves the bailout included. An orbit that is
// outside from the start has only its start.
INLINE real formula_near(trap near, vec point, mask active, orbit_record orbit, constants k) {
    state c, z;
    start(point, k, &c, &z);
    const real at_start = trap_distance(near, z);
    real nearest = FIRST_COUNT > 0 ? at_start : (real)(REAL_LARGEST);
    mask alive = active & less_equal(state_square(z), (real)(orbit->bailout_square));
    for (int n = FIRST_COUNT; n < orbit->iterations; ++n) {
        if (!any_lane(alive)) break;
        const state next = apply(n, z, c, k);
        const mask applied = going_on(alive);
        z = state_pick(applied, next, z);
        nearest = pick(applied, fmin(nearest, trap_distance(near, next)), nearest);
        alive = applied & less_equal(state_square(z), (real)(orbit->bailout_square));
    }
    return pick(less(nearest, (real)(REAL_LARGEST)), nearest, at_start);
}

// How near the orbit of a point comes to a trap, under the formula that is nearest to the point; where two flow together, between theirs.
INLINE real orbit_near(trap near, vec point, mask active, orbit_record orbit, constants k) {
    if (!JOINED) return formula_near(near, point, active, orbit, k);
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
        const real one = formula_near(near, solid_own(o, point), here | beside, o, k + o->first);
        found = pick(here, one, found);
        other = pick(beside, one, other);
        known |= here;
        other_known |= beside;
    }
    return shared(found, other, known, other_known, nearest.share);
}
