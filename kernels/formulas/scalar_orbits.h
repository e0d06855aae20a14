// Orbits that carry the formula's own scalar derivative: the distance is |z| / g with g carried as one number.
#include "formulas/packet_orbits.h"

#if HAS_DERIVATIVE
typedef struct {
    orbit_lanes lanes;
    state z;
    real growth;
} scalar_orbit;

// The first application of these orbits.
INLINE int scalar_orbit_begin(scalar_orbit *o, state *c, vec point, mask active, mask late, orbit_record orbit, constants k) {
    state z;
    start(point, k, c, &z);
    o->z = state_pick(late, o->z, z);
    o->growth = pick(late, o->growth, START_GROWTH(point));
    const int first = ORBIT_FIRST(z, active & ~late);
    orbit_lanes_begin(&o->lanes, state_square(z), first, late, active, orbit);
    return first;
}

INLINE void scalar_orbit_apply(int usual, scalar_orbit *o, int n, state c, orbit_record orbit, constants k) {
    real growth = o->growth;
    const state next = apply_derivative_by(usual, n, o->z, c, &growth, k);
    const mask alive = going_on(o->lanes.alive);
    o->z = state_pick(alive, next, o->z);
    o->growth = pick(alive, growth, o->growth);
    lanes_applied(&o->lanes, state_square(next), orbit);
}

INLINE clearance scalar_orbit_end(const scalar_orbit *o, mask active, orbit_record orbit, constants k) {
    mask inside = o->lanes.inside;
    const real count = to_reals(o->lanes.count);
    const real growth = IN_SCENE(o->growth);
    real distance;
    if (HAS_SHAPE) {
        const real solid = solid_distance(o->z, k);
        distance = most(R(0.0), solid / growth);
        if (ENDS_BY_SHAPE) inside = active & less_equal(solid, R(0.0));
    } else {
        distance = distance_from_growth(o->lanes.square, sqrt(o->lanes.square) / growth, count, orbit);
    }
    const real step = pick(inside, R(0.0), distance);
    return (clearance){step, {count, inside}, step};
}

// As `dual_orbit_by`.
INLINE clearance scalar_orbit_by(int usual, scalar_orbit *o, vec point, mask active, mask *late, int carries, orbit_record orbit,
                                 constants k) {
    const uint begun = lanes_bits(active);
    state c;
    const int first = scalar_orbit_begin(o, &c, point, active, *late, orbit, k);
    for (int n = first; IS_WITHIN_LONGEST(n, orbit) && lanes_go_on(&o->lanes, begun, carries, orbit); ++n) {
        scalar_orbit_apply(usual, o, n, c, orbit, k);
    }
    *late = o->lanes.alive;
    return scalar_orbit_end(o, active, orbit, k);
}

#define USUAL_SCALAR_ORBIT(usual) case usual: return scalar_orbit_by(usual, o, point, active, late, carries, orbit, k);
INLINE clearance formula_scalar_orbit(scalar_orbit *o, vec point, mask active, mask *late, int carries, orbit_record orbit, constants k) {
    USUALLY(USUAL_SCALAR_ORBIT)
    return scalar_orbit_by(0, o, point, active, late, carries, orbit, k);
}

INLINE clearance formula_distance(vec point, mask active, orbit_record orbit, constants k) {
    scalar_orbit o = {0};
    mask late = active & ~active;
    return formula_scalar_orbit(&o, point, active, &late, 0, orbit, k);
}

// The same of two packets side by side: an application is a chain of operations that wait for each other, and the processor works
// on the other packet's meanwhile.
INLINE void scalar_orbits_by(int usual, scalar_orbit *a, scalar_orbit *b, const vec *points, const mask *active, mask *late, int carries,
                             clearance *found, orbit_record orbit, constants k) {
    const uint begun[2] = {lanes_bits(active[0]), lanes_bits(active[1])};
    state c, d;
    const int begin_a = scalar_orbit_begin(a, &c, points[0], active[0], late[0], orbit, k);
    const int begin_b = scalar_orbit_begin(b, &d, points[1], active[1], late[1], orbit, k);
    for (int n = 0, first = 1, second = 1;; ++n) {
        // One of them may go on for long.
        if (first) first = lanes_go_on(&a->lanes, begun[0], carries, orbit);
        if (second) second = lanes_go_on(&b->lanes, begun[1], carries, orbit);
        if (!(first | second)) break;
        if (first) scalar_orbit_apply(usual, a, begin_a + n, c, orbit, k);
        if (second) scalar_orbit_apply(usual, b, begin_b + n, d, orbit, k);
    }
    late[0] = a->lanes.alive;
    late[1] = b->lanes.alive;
    found[0] = scalar_orbit_end(a, active[0], orbit, k);
    found[1] = scalar_orbit_end(b, active[1], orbit, k);
}

CALLED void other_scalar_orbits(scalar_orbit *a, scalar_orbit *b, const vec *points, const mask *active, mask *late, int carries,
                                clearance *found, orbit_record orbit, constants k) {
    scalar_orbits_by(0, a, b, points, active, late, carries, found, orbit, k);
}

#define USUAL_SCALAR_ORBITS(usual) case usual: scalar_orbits_by(usual, a, b, points, active, late, carries, found, orbit, k); return;
INLINE void formula_scalar_orbits(scalar_orbit *a, scalar_orbit *b, const vec *points, const mask *active, mask *late, int carries,
                                  clearance *found, orbit_record orbit, constants k) {
    USUALLY(USUAL_SCALAR_ORBITS)
    // What a call may see or write to stays in memory: see `formula_dual_orbit`.
    scalar_orbit first = *a, second = *b;
    const vec at[2] = {points[0], points[1]};
    const mask lanes[2] = {active[0], active[1]};
    mask go_on[2] = {late[0], late[1]};
    clearance here[2];
    other_scalar_orbits(&first, &second, at, lanes, go_on, carries, here, orbit, k);
    *a = first;
    *b = second;
    late[0] = go_on[0];
    late[1] = go_on[1];
    found[0] = here[0];
    found[1] = here[1];
}
#endif
