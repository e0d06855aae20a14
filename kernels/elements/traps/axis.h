// The axis through a point.
INLINE real axis_away(vec offset, vec direction, real radius) {
    const vec arm = vec_along(offset, -vec_dot(offset, direction), direction);
    return sqrt(vec_dot(arm, arm));
}
