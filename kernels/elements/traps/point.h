// A point.
INLINE real point_away(vec offset, vec direction, real radius) { return sqrt(vec_dot(offset, offset)); }
