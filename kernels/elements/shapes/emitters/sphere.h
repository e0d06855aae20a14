// Of a ball a direction is chosen in the cone that it fills in its own units.

// A ball's own units are those of a sphere: each direction there is one here, with the density times how much wider the angle is there
// (for the matrix A and a direction w of length 1: det A / |A w|^3).
INLINE real ball_density(vec sides, real square, vec direction) {
    const real share = R(1.0) / square, spread = share / (R(1.0) + sqrt(fmax(R(1.0) - share, R(0.0))));
    const vec own = vec_over(direction, sides);
    const real stretch = sqrt(vec_dot(own, own));
    return R(0.15915494309189535) / (spread * (sides.x * stretch) * (sides.y * stretch) * (sides.z * stretch));
}

// Whether a direction meets a ball whose own units these are; grazing ones do.
INLINE mask meets_ball(vec from, vec own) {
    const vec beside = vec_cross(from, own);
    return less(vec_dot(from, own), R(0.0)) & less_equal(vec_dot(beside, beside), R(1.0001) * vec_dot(own, own));
}

INLINE emitter_place sphere_place(vec form, vec sides, vec point, real choice, real u, real v, const vec *met) {
    const vec from = vec_over(point, sides);
    const real square = fmax(vec_dot(from, from), R(1.0));
    vec way;
    if (met) {
        way = vec_sub(*met, point);
    } else {
        const real share = R(1.0) / square;
        const vec own = cone_direction(vec_normalize(vec_scale(from, R(-1.0))), share / (R(1.0) + sqrt(R(1.0) - share)), u, v);
        // By the nearest place to the middle, as `span_of_ball`; each direction of the cone meets the ball.
        const real middle = -vec_dot(from, own);
        const vec nearest = vec_along(from, middle, own);
        const real distance = middle - sqrt(fmax(R(1.0) - vec_dot(nearest, nearest), R(0.0)));
        way = vec_mul(vec_scale(own, distance), sides);
    }
    const vec toward = vec_normalize(way);
    return (emitter_place){way, pick(meets_ball(from, vec_over(toward, sides)), ball_density(sides, square, toward), R(0.0))};
}

INLINE real sphere_weight(vec form, vec sides, vec point, real bright) {
    const real x = point.x / sides.x, y = point.y / sides.y, z = point.z / sides.z;
    const real own = x * x + y * y + z * z, square = fmax(vec_dot(point, point), (real)(REAL_SMALLEST));
    const real share = least(sides.x * sides.y * sides.z * sqrt(own / square) / square, R(1.0));
    return pick(less(R(1.0), own), LIGHT_PI * bright * share, R(0.0));
}
