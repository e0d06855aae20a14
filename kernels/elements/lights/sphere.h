// A ball that shines: as strong as the part of the sky that it fills.
INLINE incidence sphere_light(light_record light, vec point, __global const float *tables) {
    incidence in = light_from_place(light, point);
    in.strength *= least((real)(light->radius * light->radius) / (in.distance * in.distance), R(1.0));
    return in;
}
