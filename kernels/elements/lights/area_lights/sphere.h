// Of a ball a direction is chosen in the cone that it fills.

// 1 - cos of half the angle of that cone. `reach`: the square of the ball's radius.
INLINE real ball_light_spread(vec middle, real reach, vec point) {
    const vec offset = vec_sub(middle, point);
    const real square = most(vec_dot(offset, offset), (real)(REAL_SMALLEST));
    const real share = least(reach / square, R(1.0));
    return share / (R(1.0) + sqrt(R(1.0) - share));
}

INLINE mask ball_light_met(vec middle, real reach, vec origin, vec direction, real *distance) {
    const vec offset = vec_sub(middle, origin);
    const real along = vec_dot(offset, direction);
    const vec across = vec_along(offset, -along, direction);
    const real inside = reach - vec_dot(across, across);
    *distance = along - sqrt(most(inside, R(0.0)));
    return less_equal(R(0.0), inside) & less(R(0.0), *distance);
}

INLINE real sphere_light_reach(light_record light) { return (real)(light->radius * light->radius); }

INLINE real sphere_light_spread(light_record light, vec point) {
    return ball_light_spread(vec_splat(light->vector), sphere_light_reach(light), point);
}

INLINE vec sphere_light_direction(light_record light, vec point, vec middle, real u, real v) {
    return cone_direction(middle, sphere_light_spread(light, point), u, v);
}

INLINE real sphere_light_density(light_record light, vec point, vec direction) {
    return R(1.0) / (R(2.0) * LIGHT_PI * sphere_light_spread(light, point));
}

INLINE real sphere_light_distance(light_record light, vec point, vec direction, real middle) {
    return most(middle - (real)(light->radius), R(0.0));
}

INLINE mask sphere_light_met(light_record light, vec origin, vec direction, real *distance) {
    return ball_light_met(vec_splat(light->vector), sphere_light_reach(light), origin, direction, distance);
}

INLINE vec sphere_light_normal(light_record light, vec place) { return vec_sub(place, vec_splat(light->vector)); }
