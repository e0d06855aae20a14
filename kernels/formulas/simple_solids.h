// Shapes that are joined to formulas: how far a place is from one, and on which side. And what is known of
// a place and any one solid.
#include "geometry/shapes.h"

INLINE vec solid_own(orbit_record o, vec point) {
    const vec a = vec_sub(point, vec_splat(o->middle));
    return vec_along_axes(o, a);
}

// What is inside of solids and one more, by how that is joined to them.
INLINE mask inside_joined(int join, mask all, mask one) {
    return join == JOIN_CUT ? all & ~one : join == JOIN_INTERSECTION ? all & one : all | one;
}

// A gradient in its own units as a direction of space.
INLINE vec solid_turned(orbit_record o, vec own) { return vec_normalize(vec_of_axes(o, own)); }

// What is known of a point and one solid, or of several: how far it is at least, below 0 in simple solids, and at most. These differ in
// hollows only, where nobody knows how far the wall is. `near`: how near its surface may be, the same number but where only the ball
// around a formula is known. That is no surface: `near` is beyond all there. `apart`: by which the nearest of several is chosen.
typedef struct {
    real far, most, near, apart, scale;
    mask inside;
    real body;    // of what is inside: the body there that light goes through, or BODY_OPAQUE; the highest of several
    surface_point surface;
} solid_found;

// How far a place is from a shape, in whose own units its sides are at -1 and 1; whether it is inside; and all that is known of it.
INLINE real simple_far(orbit_record o, vec own) {
    vec ignored;
    return shape_far(o->kind, vec_splat(o->form), own, vec_splat(o->sides), &ignored);
}

INLINE mask simple_holds(orbit_record o, vec own) { return less_equal(simple_far(o, own), R(0.0)); }

// Which points of one solid are left by the planes that open it alone.
INLINE mask solid_left(orbit_record o, vec point, mask inside) {
    for (int i = 0; i < o->planes; ++i) {
        orbit_record plane = o + o->first_plane + i;
        inside &= simple_holds(plane, solid_own(plane, point));
    }
    return inside;
}

INLINE void solid_simple(orbit_record o, vec own, solid_found *found) {
    vec n;
    found->far = shape_far(o->kind, vec_splat(o->form), own, vec_splat(o->sides), &n);
    found->inside = less_equal(found->far, R(0.0));
    found->surface.gradient = solid_turned(o, n);
}
