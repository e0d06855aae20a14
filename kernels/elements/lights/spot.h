// Light from a point into a cone.

// The part of its light that goes away from it opposite to `toward`.
INLINE real spot_shows(light_record light, vec toward) {
    const vec axis = vec_splat(light->axis);
    const real along = -vec_dot(toward, axis);
    // Of the angle, which keeps its digits in narrow cones.
    const vec across = vec_cross(toward, axis);
    const real angle = atan2(sqrt(vec_dot(across, across)), along);
    const scalar wide = light->rim[0], narrow = light->rim[1];
    if (wide <= narrow) return pick(less_equal(angle, (real)(wide)), R(1.0), R(0.0));
    const real t = most(least(((real)(wide) - angle) * (real)(S(1.0) / (wide - narrow)), R(1.0)), R(0.0));
    return t * t * (R(3.0) - R(2.0) * t);
}

INLINE incidence spot_light(light_record light, vec point, __global const float *tables) {
    incidence in = light_from_place(light, point);
    in.strength *= spot_shows(light, in.toward);
    return in;
}
