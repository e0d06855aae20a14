// Light from infinitely far away.
INLINE incidence directional_light(light_record light, vec point, __global const float *tables) {
    return (incidence){vec_scale(vec_splat(light->vector), R(-1.0)), (real)(REAL_LARGEST), (real)(light->intensity)};
}
