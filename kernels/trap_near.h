// How near the orbit of a point comes to a trap.
// From the first three variables of z to the trap.
INLINE real trap_distance(trap near, state z) {
    const vec offset = vec_sub(vec_of(z.s0, z.s1, z.s2), near.center);
    const real along = vec_dot(offset, near.direction);
    if (near.shape == TRAP_PLANE) return fabs(along);
    const vec arm = near.shape == TRAP_AXIS ? vec_along(offset, -along, near.direction) : offset;
    return fabs(sqrt(vec_dot(arm, arm)) - (near.shape == TRAP_SPHERE ? near.radius : R(0.0)));
}

// How near z comes to a trap after one application or more, the one that leaves the bailout included. An orbit that is
// outside from the start has only its start.
INLINE real orbit_near(trap near, vec point, mask active, __constant const struct Orbit *orbit, __constant const scalar *k) {
    state c, z;
    start(point, k, &c, &z);
    const real at_start = trap_distance(near, z);
    real nearest = FIRST_COUNT > 0 ? at_start : (real)(REAL_LARGEST);
    mask alive = active & less_equal(state_square(z), (real)(orbit->bailout_square));
    for (int n = FIRST_COUNT; n < orbit->iterations; ++n) {
        if (!any_lane(alive)) break;
        const state next = apply(n, z, c, k);
        z = state_pick(alive, next, z);
        nearest = pick(alive, fmin(nearest, trap_distance(near, next)), nearest);
        alive &= less_equal(state_square(z), (real)(orbit->bailout_square));
    }
    return pick(less(nearest, (real)(REAL_LARGEST)), nearest, at_start);
}
