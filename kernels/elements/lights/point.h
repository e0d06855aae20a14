// Light from a point.
INLINE incidence point_light(light_record light, vec point, __global const float *tables) { return light_from_place(light, point); }
