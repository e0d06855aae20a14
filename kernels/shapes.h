// Shapes in units of their own, into which places and rays are brought: all is between -1 and 1 there, or below z = 0; distances along a
// ray stay the same. `form`: numbers of the shape's own. A kind is a file of `elements/shapes` with these functions:
//   span NAME_span(vec form, int number, vec from, vec way)      a part of a ray's line within; most shapes have one only
//   vec NAME_normal(vec form, vec own)                           at a place of the surface, away from the inside; of any length
//   vec NAME_on(vec form, vec own)                               that place without the rounding of the way there
//   mask NAME_holds(vec form, vec own)                           whether a place is inside
//   real NAME_far(vec form, vec own, vec sides, vec *n)          how far the surface is in scene units, below 0 inside, and the direction
//                                                                away from it, by components as the normal's
// A solid also has a file of `elements/shapes/emitters`, with the functions of `emitter_places.h`.

// A direction's component as a divisor.
INLINE real divisor(real a) { return pick(less(fabs(a), R(1e-30)), R(1e-30), a); }

// `exit` is below `entry` where there is none.
typedef struct {
    real entry, exit;
} span;

INLINE span span_of_both(span a, span b) { return (span){fmax(a.entry, b.entry), fmin(a.exit, b.exit)}; }

// Between two places where a ray's component is -1 and 1.
INLINE span span_of_slab(real from, real way) {
    const real share = R(1.0) / divisor(way), a = (R(-1.0) - from) * share, b = (R(1.0) - from) * share;
    return (span){fmin(a, b), fmax(a, b)};
}

// The first place of a span's rim on a ray, or the largest number: where it enters a solid, or from inside where it leaves it.
INLINE real span_first(span s) {
    const real first = pick(less(R(0.0), s.entry), s.entry, s.exit);
    return pick(less(s.entry, s.exit) & less(R(0.0), first), first, (real)(REAL_LARGEST));
}

INLINE real above_length(real a, real b, real c) {
    const real x = fmax(a, R(0.0)), y = fmax(b, R(0.0)), z = fmax(c, R(0.0));
    return sqrt(x * x + y * y + z * z);
}

// Within the ball of radius 1.
INLINE span span_of_ball(vec from, vec way) {
    // By the way's nearest place to the middle, since b^2 - c would cancel for a far-off origin.
    const real share = R(1.0) / fmax(sqrt(vec_dot(way, way)), R(1e-30));
    const vec along = vec_scale(way, share);
    const real middle = -vec_dot(from, along);
    const vec nearest = vec_along(from, middle, along);
    const real square = R(1.0) - vec_dot(nearest, nearest), half_chord = sqrt(fmax(square, R(0.0)));
    const mask meets = less(R(0.0), square);
    return (span){pick(meets, (middle - half_chord) * share, R(1.0)), pick(meets, (middle + half_chord) * share, R(-1.0))};
}

#include "elements/shapes"

// By the kind of a record. Of other kinds there is no span, and a place is what it is.
#define SPAN_OF(KIND, name) case SHAPE_##KIND: return name##_span(form, number, from, way);
INLINE span shape_span(int kind, vec form, int number, vec from, vec way) {
    switch (kind) { SHAPES(SPAN_OF) default: return (span){R(1.0), R(-1.0)}; }
}
#define NORMAL_OF(KIND, name) case SHAPE_##KIND: return name##_normal(form, own);
INLINE vec shape_normal(int kind, vec form, vec own) { switch (kind) { SHAPES(NORMAL_OF) default: return vec_of(R(0.0), R(0.0), R(1.0)); } }
#define ON(KIND, name) case SHAPE_##KIND: return name##_on(form, own);
INLINE vec shape_on(int kind, vec form, vec own) { switch (kind) { SHAPES(ON) default: return own; } }
#define HOLDS(KIND, name) case SHAPE_##KIND: return name##_holds(form, own);
INLINE mask shape_holds(int kind, vec form, vec own) { switch (kind) { SHAPES(HOLDS) default: return less(R(1.0), R(0.0)); } }
#define FAR_FROM(KIND, name) case SHAPE_##KIND: return name##_far(form, own, sides, n);
INLINE real shape_far(int kind, vec form, vec own, vec sides, vec *n) { switch (kind) { SHAPES(FAR_FROM) default: return own.z; } }
