// Orbits of points under the formula, as one loop over a packet: escape counts and inside tests; and what the end of any orbit says.
//
// From the generated text: STATE_SIZE, STATE_CARRIED (numbers beside z, if there are any), state, dual_state, FIRST_COUNT (applications that the starting state already counts),
// LOGARITHMIC (the degree is above 1), HAS_DERIVATIVE, HAS_SHAPE, HAS_CALLS (of exp, sin and their like), start, dual_start, apply,
// apply_derivative and dual_apply (each also as ..._by), has_usual_values and its answers beside 0 (EACH_USUAL), state_pick,
// dual_state_pick, state_square, solid_distance.
// Of several formulas they are of the one whose constants are given, and what these do not have in common is read from its `orbit`; so is
// what differs between the links of a chain, each of which may be the first one and the last.
//
// A lane's orbit runs until |z| exceeds the distance bailout. The solid is the set of points with |z| <= bailout after
// `iterations` applications; a lane that left the bailout by then but not yet the larger radius goes on a little longer.

#include "formulas/orbit_types.h"

// Where a scene shows a place of a formula's space, magnified, orbits begin at counts of their own, and wait for them (place.h).
// ORBIT_FIRST: the first application of those of some lanes. HAS_BEGUN: which of them wait no longer. START_GROWTH: the scalar derivative
// where they begin. IN_SCENE: from a change in the formula's space to one in the scene's.
#ifdef SHOWS_PLACE
#define ORBIT_FIRST(z, lanes) placed_first((z).begun, lanes)
#define HAS_BEGUN(z) equal((z).begun, R(0.0))
#define START_GROWTH(point) start_growth(point, k)
#define IN_SCENE(change) ((change) * (real)(orbit->unit))
#else
#define ORBIT_FIRST(z, lanes) FIRST_COUNT
#define HAS_BEGUN(z) equal(R(0.0), R(0.0))
#define START_GROWTH(point) R(1.0)
#define IN_SCENE(change) (change)
#endif

// Whether a shape, or a distance that a formula tells itself, says what is inside; where |z| grows by powers, the bailout does.
#define ENDS_BY_SHAPE (HAS_SHAPE && !LOGARITHMIC)
// Whether numbers go on beside z: equal z need not have equal futures then.
#ifdef STATE_CARRIED
#define CARRIES_NUMBERS 1
#else
#define CARRIES_NUMBERS 0
#endif

// Distance to the solid from the last |z|, its count and the growth of |z| per scene unit, g = |J^T z / |z||, given relative
// to |z|: `relative` = |z| / g.
//
// Degree > 1: |z_n| grows like exp(G degree^n) with G the potential, so |z| log|z| / (2 g) is half of G / |grad G| (Hart,
// Sandin, Kauffman 1989; the half makes it a lower bound for conformal maps). The solid of `iterations` applications is the
// level set of G at L = log(bailout) / degree^iterations. The map of a half plane that bends space most, w -> w^2, has the
// distance (G^2 - L^2) / (2 G |grad G|). Far outside the distance is at most (1 - exp(-G)) / |grad G|, that of a ball.
INLINE real distance_from_growth(real square, real relative, real count, orbit_record orbit) {
    real distance;
    if (LOGARITHMIC) {
        const real height = R(0.34657359028) * quick_log2(square);  // half of log 2
        const real counts_left = (real)((scalar)orbit->iterations) - count;
        const real level = (real)(orbit->log_bailout) * quick_exp2(-counts_left * (real)(orbit->log2_degree)) / height;
        const real far = height * quick_exp2(-count * (real)(orbit->log2_degree));
        const real share = (R(1.0) - level * level) / (R(1.0) + far * (R(0.5) + R(0.0833333333) * far));
        distance = R(0.5) * height * relative * share;
    } else {
        distance = (R(1.0) - (real)(orbit->solid_radius) / sqrt(square)) * relative;
    }
    // An overflow of the derivative means that the surface is nearer than the number type can resolve.
    return most(R(0.0), pick(is_nan(distance), R(0.0), distance));
}

// Lanes that end the orbit inside at the iteration limit: true for those still within the bailout.
INLINE mask in_set(real square, orbit_record orbit) { return less_equal(square, (real)(orbit->bailout_square)); }

// Escape counts with `bailout` alone: applications until |z| > bailout, at most `iterations`.
INLINE orbit_counted formula_escape_count(vec point, mask active, orbit_record orbit, constants k) {
    state c, z;
    start(point, k, &c, &z);
    real square = state_square(z);
    mask alive = active & less_equal(square, (real)(orbit->bailout_square));
    const int first = ORBIT_FIRST(z, active);
    mask count = (active & ~active) + min(first, orbit->iterations);
    for (int n = first, look = first + ORBIT_LOOK; n < orbit->iterations; ++n) {
        if (!any_lane(alive)) break;
        if (n == look) {
            if (orbit_cancelled(orbit)) break;
            look += ORBIT_LOOK;
        }
        const state next = apply(n, z, c, k);
        const mask applied = going_on(alive);
        z = state_pick(applied, next, z);
        square = pick(applied, state_square(next), square);
        count -= applied;  // true is -1
        alive = applied & less_equal(square, (real)(orbit->bailout_square));
    }
    return (orbit_counted){count, alive};
}

// Orbits are written for the `usual` values of a formula's exponents and conditions, which are literals then, and for any: a branch
// around the whole orbit, since what others call moves all registers into memory. Of several formulas each has an orbit of its own for
// its usual values, or branches within would move its state, too.
#define USUALLY(DO) switch (has_usual_values(k)) { EACH_USUAL(DO) }

// Which points belong to the solid of `limit` applications: the inside of the distances below, without the distance. The
// solids of fewer applications hold those of more (but for an orbit that comes back from beyond the distance bailout).
INLINE orbit_end end_by(int usual, vec point, mask active, int limit, orbit_record orbit, constants k) {
    state c, z;
    start(point, k, &c, &z);
    real square = state_square(z);
    const int first = ORBIT_FIRST(z, active);
    real count = (real)((scalar)min(first, limit));
    mask alive = active & less_equal(square, (real)(orbit->distance_square));
    for (int n = first, look = first + ORBIT_LOOK; n < limit; ++n) {
        if (!any_lane(alive)) break;
        if (n == look) {
            if (orbit_cancelled(orbit)) break;
            look += ORBIT_LOOK;
        }
        const state next = apply_by(usual, n, z, c, k);
        const mask applied = going_on(alive);
        z = state_pick(applied, next, z);
        square = pick(applied, state_square(next), square);
        count = pick(applied, (real)((scalar)(n + 1)), count);
        alive = applied & less_equal(square, (real)(orbit->distance_square));
    }
    alive = ENDS_BY_SHAPE ? active & less_equal(solid_distance(z, k), R(0.0)) : alive & in_set(square, orbit);
    return (orbit_end){count, alive};
}

#define USUAL_END(usual) case usual: return end_by(usual, point, active, limit, orbit, k);
INLINE orbit_end formula_end(vec point, mask active, int limit, orbit_record orbit, constants k) {
    USUALLY(USUAL_END)
    return end_by(0, point, active, limit, orbit, k);
}

// Smooth escape count: where between two applications |z| passed the distance bailout. Degree > 1 grows doubly exponentially
// (n + 1 - log(log|z| / log R) / log degree), degree 1 exponentially.
INLINE real formula_smooth_count(orbit_end end, orbit_result result, orbit_record orbit) {
    const real log_radius = (real)(orbit->log_distance_bailout);
    real over;
    if (LOGARITHMIC) over = log2(R(0.5) * log(most(R(1.0), result.square)) / log_radius) / (real)(orbit->log2_degree);
    else over = (R(0.5) * log(result.square) - log_radius) / (R(0.5) * log(result.square / result.square_before));
    const real smooth = end.count - pick(is_nan(over), R(0.0), bounded(over, R(0.0), R(1.0)));
    return pick(end.inside, (real)((scalar)orbit->iterations), smooth);
}

// The potential G = log|z_n| / degree^n, which falls towards the solid. Linear maps have none: 0, as near as can be.
INLINE real formula_potential(orbit_end end, orbit_result result, orbit_record orbit) {
    if (!LOGARITHMIC) return R(0.0);
    return R(0.34657359028) * quick_log2(result.square) * exp2(-end.count * (real)(orbit->log2_degree));
}
