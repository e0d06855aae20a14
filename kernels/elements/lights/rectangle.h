// A rectangle that shines on one side: as strong as the part of the sky that it fills, from afar.
INLINE incidence rectangle_light(light_record light, vec point, __global const float *tables) {
    incidence in = light_from_place(light, point);
    const real along = -vec_dot(in.toward, vec_splat(light->axis)), square = in.distance * in.distance;
    in.strength *= (real)(light->area) * R(0.3183098861837907) * most(along, R(0.0)) / square;
    return in;
}
