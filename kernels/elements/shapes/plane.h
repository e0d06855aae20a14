// All below a plane.
enum { plane_turn = EQUATION };
INLINE span plane_span(vec form, int number, vec from, vec way) {
    const real t = -from.z / divisor(way.z), all = (real)(REAL_LARGEST);
    const mask down = less(way.z, R(0.0));
    return (span){pick(down, t, -all), pick(down, all, t)};
}

INLINE vec plane_normal(vec form, vec own) { return vec_of(R(0.0), R(0.0), R(1.0)); }
INLINE vec plane_bends(vec form, vec own, vec way) { return vec_of(R(0.0), R(0.0), R(0.0)); }
INLINE vec plane_on(vec form, vec own) { return vec_of(own.x, own.y, R(0.0)); }
INLINE mask plane_holds(vec form, vec own) { return less(own.z, R(0.0)); }

INLINE real plane_far(vec form, vec own, vec sides, vec *n) {
    *n = vec_of(R(0.0), R(0.0), R(1.0));
    return own.z;
}
