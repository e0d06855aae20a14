// The ball of radius 1. With unequal sides its distances are too small, but not their directions.
INLINE span ball_span(vec from, vec way) {
    // By the way's nearest place to the middle, since b^2 - c would cancel for a far-off origin.
    const real share = R(1.0) / fmax(sqrt(vec_dot(way, way)), R(1e-30));
    const vec along = vec_scale(way, share);
    const real middle = -vec_dot(from, along);
    const vec nearest = vec_along(from, middle, along);
    const real square = R(1.0) - vec_dot(nearest, nearest), half_chord = sqrt(fmax(square, R(0.0)));
    const mask meets = less(R(0.0), square);
    return (span){pick(meets, (middle - half_chord) * share, R(1.0)), pick(meets, (middle + half_chord) * share, R(-1.0))};
}

INLINE vec ball_normal(vec own) { return own; }

INLINE vec ball_on(vec own) {
    const real square = own.x * own.x + own.y * own.y;
    return vec_scale(own, R(1.0) / fmax(sqrt(square + own.z * own.z), R(1e-30)));
}

INLINE mask ball_holds(vec own) {
    const real across = own.x * own.x + own.y * own.y;
    return less(across + own.z * own.z, R(1.0));
}

INLINE real ball_far(vec own, vec sides, vec *n) {
    *n = own;
    return (sqrt(vec_dot(own, own)) - R(1.0)) * fmin(fmin(sides.x, sides.y), sides.z);
}
