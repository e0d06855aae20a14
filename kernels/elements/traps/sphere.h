// The sphere around a point.
INLINE real sphere_away(vec offset, vec direction, real radius) { return fabs(sqrt(vec_dot(offset, offset)) - radius); }
