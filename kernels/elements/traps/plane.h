// The plane through a point.
INLINE real plane_away(vec offset, vec direction, real radius) { return fabs(vec_dot(offset, direction)); }
