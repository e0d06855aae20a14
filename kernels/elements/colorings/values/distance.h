// How far from a place.
INLINE real distance_value(vec point, vec normal, real smooth, real residual, vec given) {
    const vec way = vec_sub(point, given);
    return sqrt(vec_dot(way, way));
}
