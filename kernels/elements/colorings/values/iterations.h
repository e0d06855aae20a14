// The smooth escape count.
INLINE real iterations_value(vec point, vec normal, real smooth, real residual, vec given) { return smooth; }
