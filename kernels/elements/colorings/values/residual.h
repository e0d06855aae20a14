// How far a pixel's points are from the plane fitted to them.
INLINE real residual_value(vec point, vec normal, real smooth, real residual, vec given) { return residual; }
