// How far along a direction.
INLINE real height_value(vec point, vec normal, real smooth, real residual, vec given) { return vec_dot(point, given); }
