// The ball of radius 1. With unequal sides its distances are too small, but not their directions.
enum { sphere_turn = EQUATION };
INLINE span sphere_span(vec form, int number, vec from, vec way) { return span_of_ball(from, way); }

INLINE vec sphere_normal(vec form, vec own) { return own; }

INLINE vec sphere_bends(vec form, vec own, vec way) { return way; }

INLINE vec sphere_on(vec form, vec own) {
    const real square = own.x * own.x + own.y * own.y;
    return vec_scale(own, R(1.0) / fmax(sqrt(square + own.z * own.z), R(1e-30)));
}

INLINE mask sphere_holds(vec form, vec own) {
    const real across = own.x * own.x + own.y * own.y;
    return less(across + own.z * own.z, R(1.0));
}

INLINE real sphere_far(vec form, vec own, vec sides, vec *n) {
    *n = own;
    return (sqrt(vec_dot(own, own)) - R(1.0)) * fmin(fmin(sides.x, sides.y), sides.z);
}
