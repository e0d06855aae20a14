// Three numbers for each lane, and what is done with each alike: TYPE_of, TYPE_add, TYPE_mul, TYPE_scale, TYPE_pick.
#define THREE_NUMBERS(type, x, y, z)                                                                                        \
    typedef struct {                                                                                                        \
        real x, y, z;                                                                                                       \
    } type;                                                                                                                 \
    INLINE type type##_of(real a, real b, real c) { return (type){a, b, c}; }                                               \
    INLINE type type##_add(type a, type b) { return type##_of(a.x + b.x, a.y + b.y, a.z + b.z); }                           \
    INLINE type type##_mul(type a, type b) { return type##_of(a.x * b.x, a.y * b.y, a.z * b.z); }                           \
    INLINE type type##_scale(type a, real s) { return type##_of(a.x * s, a.y * s, a.z * s); }                               \
    INLINE type type##_pick(mask m, type a, type b) { return type##_of(pick(m, a.x, b.x), pick(m, a.y, b.y), pick(m, a.z, b.z)); }

// Points and directions in scene units, and colours, linear Rec. 709.
THREE_NUMBERS(vec, x, y, z)
THREE_NUMBERS(color, r, g, b)

// Three numbers of a struct, the same for all lanes. A macro, as they may lie in any memory.
#define vec_splat(a) vec_of((real)((a)[0]), (real)((a)[1]), (real)((a)[2]))
#define vec_of_counts(a) vec_of((real)((scalar)(a)[0]), (real)((scalar)(a)[1]), (real)((scalar)(a)[2]))
// A vector by the three axes of a record, and from its numbers along these.
#define own_axis(o, i) vec_splat((o)->own_##i)
#define vec_along_axes(o, a) vec_of(vec_dot(a, own_axis(o, x)), vec_dot(a, own_axis(o, y)), vec_dot(a, own_axis(o, z)))
#define vec_of_axes(o, a) \
    vec_add(vec_add(vec_scale(own_axis(o, x), (a).x), vec_scale(own_axis(o, y), (a).y)), vec_scale(own_axis(o, z), (a).z))
INLINE vec vec_sub(vec a, vec b) { return vec_of(a.x - b.x, a.y - b.y, a.z - b.z); }
INLINE vec vec_over(vec a, vec b) { return vec_of(a.x / b.x, a.y / b.y, a.z / b.z); }
// The point `distance` along a direction.
INLINE vec vec_along(vec from, real distance, vec direction) {
    return vec_of(from.x + distance * direction.x, from.y + distance * direction.y, from.z + distance * direction.z);
}
INLINE real vec_dot(vec a, vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
INLINE vec vec_cross(vec a, vec b) { return vec_of(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x); }

// Of three numbers for each lane, and as these.
#define vec_load(a) vec_of(lanes_load((a)[0]), lanes_load((a)[1]), lanes_load((a)[2]))
INLINE void vec_store(vec v, scalar a[3][LANES]) {
    lanes_store(v.x, a[0]);
    lanes_store(v.y, a[1]);
    lanes_store(v.z, a[2]);
}

// Length 1; a vector that is zero or not finite becomes zero. Scaled by the largest component first, so that squares neither
// overflow nor vanish.
INLINE vec vec_normalize(vec a) {
    const real largest = most(most(fabs(a.x), fabs(a.y)), fabs(a.z));
    const vec b = vec_scale(a, R(1.0) / largest);
    const real square = vec_dot(b, b);  // 1 to 3, if a is usable
    const mask usable = less(R(0.0), square) & less_equal(square, R(4.0));
    return vec_pick(usable, vec_scale(b, R(1.0) / sqrt(square)), vec_of(R(0.0), R(0.0), R(0.0)));
}

// Whether any lane has some of it.
INLINE int any_of(real weight) { return any_lane(less(R(0.0), weight)); }
