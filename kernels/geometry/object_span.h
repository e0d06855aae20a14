// An object's own units, and where a ray is in it.
#include "geometry/shapes.h"

INLINE vec object_own(object_record o, vec a) { return vec_along_axes(o, a); }

// Where a ray enters and leaves what an object is. `number`: of one of its parts, which most shapes have one of.
INLINE span object_span(object_record o, int turn, int number, vec origin, vec direction) {
    const vec from = object_own(o, vec_sub(origin, vec_splat(o->middle))), way = object_own(o, direction);
    return shape_span(o->kind, turn, vec_splat(o->form), number, from, way);
}

// And where the box of its grid.
INLINE span grid_span(object_record o, vec origin, vec direction) {
    const vec from = object_own(o, vec_sub(origin, vec_splat(o->middle))), way = object_own(o, direction);
    return box_span(vec_splat(o->form), 0, from, way);
}
