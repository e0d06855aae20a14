// All below a plane.
INLINE span flat_span(vec from, vec way) {
    const real t = -from.z / divisor(way.z), all = (real)(REAL_LARGEST);
    const mask down = less(way.z, R(0.0));
    return (span){pick(down, t, -all), pick(down, all, t)};
}

INLINE vec flat_normal(vec own) { return vec_of(R(0.0), R(0.0), R(1.0)); }
INLINE vec flat_on(vec own) { return vec_of(own.x, own.y, R(0.0)); }
INLINE mask flat_holds(vec own) { return less(own.z, R(0.0)); }

INLINE real flat_far(vec own, vec sides, vec *n) {
    *n = vec_of(R(0.0), R(0.0), R(1.0));
    return own.z;
}
