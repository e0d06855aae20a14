// The normal's part along a direction.
INLINE real normal_value(vec point, vec normal, real smooth, real residual, vec given) { return vec_dot(normal, given); }
