// Points and directions in scene units, one per lane.
typedef struct {
    real x, y, z;
} vec;

INLINE vec vec_of(real x, real y, real z) {
    const vec r = {x, y, z};
    return r;
}
INLINE vec vec_splat(__constant const scalar *a) { return vec_of((real)(a[0]), (real)(a[1]), (real)(a[2])); }
INLINE vec vec_add(vec a, vec b) { return vec_of(a.x + b.x, a.y + b.y, a.z + b.z); }
INLINE vec vec_sub(vec a, vec b) { return vec_of(a.x - b.x, a.y - b.y, a.z - b.z); }
INLINE vec vec_scale(vec a, real s) { return vec_of(a.x * s, a.y * s, a.z * s); }
// The point `distance` along a direction.
INLINE vec vec_along(vec from, real distance, vec direction) {
    return vec_of(from.x + distance * direction.x, from.y + distance * direction.y, from.z + distance * direction.z);
}
INLINE real vec_dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
INLINE vec vec_pick(mask m, vec yes, vec no) {
    return vec_of(pick(m, yes.x, no.x), pick(m, yes.y, no.y), pick(m, yes.z, no.z));
}

// Length 1; the zero vector stays zero. Scaled by the largest component first, so that squares neither overflow nor vanish.
INLINE vec vec_normalize(vec a) {
    const real largest = fmax(fmax(fabs(a.x), fabs(a.y)), fabs(a.z));
    const mask usable = less(R(0.0), largest) & less_equal(largest, (real)(REAL_LARGEST));
    const real shrink = pick(usable, R(1.0) / largest, R(0.0));
    const vec b = vec_scale(a, shrink);
    const real square = vec_dot(b, b);
    return vec_scale(b, pick(usable, R(1.0) / sqrt(square), R(0.0)));
}
