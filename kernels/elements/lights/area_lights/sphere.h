// Of a ball a direction is chosen in the cone that it fills.

// 1 - cos of half the angle of that cone.
INLINE real sphere_light_spread(light_record light, vec point) {
    const vec offset = vec_sub(vec_splat(light->vector), point);
    const real square = most(vec_dot(offset, offset), (real)(REAL_SMALLEST));
    const real share = least((real)(light->radius * light->radius) / square, R(1.0));
    return share / (R(1.0) + sqrt(R(1.0) - share));
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
    const vec offset = vec_sub(vec_splat(light->vector), origin);
    const real along = vec_dot(offset, direction);
    const vec across = vec_along(offset, -along, direction);
    const real inside = (real)(light->radius * light->radius) - vec_dot(across, across);
    *distance = along - sqrt(most(inside, R(0.0)));
    return less_equal(R(0.0), inside) & less(R(0.0), *distance);
}

INLINE vec sphere_light_normal(light_record light, vec place) { return vec_sub(place, vec_splat(light->vector)); }
