// Shapes in units of their own, into which places and rays are brought: a ball, cube or cylinder of radius 1, or all below z = 0;
// distances along a ray stay the same there. A kind is a file with these functions, and its name in the table:
//   span NAME_span(vec from, vec way)           the part of a ray's line within
//   vec NAME_normal(vec own)                    at a place of the surface, away from the inside; of any length
//   vec NAME_on(vec own)                        that place without the rounding of the way there
//   mask NAME_holds(vec own)                    whether a place is inside
//   real NAME_far(vec own, vec sides, vec *n)   how far the surface is in scene units, below 0 inside, and the direction away from it
// One that can shine also has the functions of emitter_places.h.
#define SHAPES(DO) DO(PLANE, flat) DO(SPHERE, ball) DO(BOX, box) DO(CYLINDER, cylinder)

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

#include "shape_flat.h"
#include "shape_ball.h"
#include "shape_box.h"
#include "shape_cylinder.h"

// By the kind of a record. Of other kinds there is no span, and a place is what it is.
#define SPAN_OF(KIND, name) case SHAPE_##KIND: return name##_span(from, way);
INLINE span shape_span(int kind, vec from, vec way) { switch (kind) { SHAPES(SPAN_OF) default: return (span){R(1.0), R(-1.0)}; } }
#define NORMAL_OF(KIND, name) case SHAPE_##KIND: return name##_normal(own);
INLINE vec shape_normal(int kind, vec own) { switch (kind) { SHAPES(NORMAL_OF) default: return vec_of(R(0.0), R(0.0), R(1.0)); } }
#define ON(KIND, name) case SHAPE_##KIND: return name##_on(own);
INLINE vec shape_on(int kind, vec own) { switch (kind) { SHAPES(ON) default: return own; } }
#define HOLDS(KIND, name) case SHAPE_##KIND: return name##_holds(own);
INLINE mask shape_holds(int kind, vec own) { switch (kind) { SHAPES(HOLDS) default: return less(R(1.0), R(0.0)); } }
#define FAR_FROM(KIND, name) case SHAPE_##KIND: return name##_far(own, sides, n);
INLINE real shape_far(int kind, vec own, vec sides, vec *n) { switch (kind) { SHAPES(FAR_FROM) default: return own.z; } }
