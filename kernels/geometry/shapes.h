// Shapes in units of their own, into which places and rays are brought: all is between -1 and 1 there, or below z = 0; distances along a
// ray stay the same. `form`: numbers of the shape's own. A kind is a file of `elements/shapes` with these functions:
//   span NAME_span(vec form, int number, vec from, vec way)      a part of a ray's line within; most shapes have one only
//   vec NAME_normal(vec form, vec own)                           at a place of the surface, away from the inside; of any length
//   vec NAME_bends(vec form, vec own, vec way)                   how that changes there on a way along the surface
//   vec NAME_on(vec form, vec own)                               that place without the rounding of the way there
//   mask NAME_holds(vec form, vec own)                           whether a place is inside
//   real NAME_far(vec form, vec own, vec sides, vec *n)          how far the surface is in scene units, below 0 inside, and the direction
//                                                                away from it, by components as the normal's
//   enum { NAME_turn = EQUATION }                                and how its span is found: by an EQUATION that is solved at once, of
//                                                                one part, or by a SEARCH in steps and perhaps of several parts,
//                                                                whose registers other shapes do not pay for
// It also has a file of `elements/shapes/emitters`, with the functions of `emitter_places.h`.

#include "geometry/spans.h"

// In which turn of `objects_met` an object is met: by the equation of its boundary, by a search of its own, among waves and among values on
// grids, which are searched only before all else; or not there. Where a turn is ANY_TURN, that is not asked.
enum { EQUATION, SEARCH, WATER, GRID, NOT_MET, ANY_TURN };

#include "elements/shapes"

// By the kind of a record. Of other kinds there is no span, and a place is what it is.
#define TURN_OF(KIND, name) case SHAPE_##KIND: return name##_turn;
INLINE int shape_turn(int kind) { switch (kind) { SHAPES(TURN_OF) default: return NOT_MET; } }
// (Where `turn` is a constant, only the shapes of that turn are compiled.)
#define SPAN_OF(KIND, name) \
    case SHAPE_##KIND: if (turn == name##_turn || turn == ANY_TURN) return name##_span(form, number, from, way); break;
INLINE span shape_span(int kind, int turn, vec form, int number, vec from, vec way) {
    switch (kind) { SHAPES(SPAN_OF) }
    return (span){R(1.0), R(-1.0)};
}
#define NORMAL_OF(KIND, name) case SHAPE_##KIND: return name##_normal(form, own);
INLINE vec shape_normal(int kind, vec form, vec own) { switch (kind) { SHAPES(NORMAL_OF) default: return vec_of(R(0.0), R(0.0), R(1.0)); } }
#define BENDS(KIND, name) case SHAPE_##KIND: return name##_bends(form, own, way);
INLINE vec shape_bends(int kind, vec form, vec own, vec way) { switch (kind) { SHAPES(BENDS) default: return vec_of(R(0.0), R(0.0), R(0.0)); } }
#define ON(KIND, name) case SHAPE_##KIND: return name##_on(form, own);
INLINE vec shape_on(int kind, vec form, vec own) { switch (kind) { SHAPES(ON) default: return own; } }
#define HOLDS(KIND, name) case SHAPE_##KIND: return name##_holds(form, own);
INLINE mask shape_holds(int kind, vec form, vec own) { switch (kind) { SHAPES(HOLDS) default: return less(R(1.0), R(0.0)); } }
#define FAR_FROM(KIND, name) case SHAPE_##KIND: return name##_far(form, own, sides, n);
INLINE real shape_far(int kind, vec form, vec own, vec sides, vec *n) { switch (kind) { SHAPES(FAR_FROM) default: return own.z; } }
