// Pictures of grids that ask no formula: normals are blended, and there are no planes.
#include "integrators/volume/volume_sight.h"

// The normal of a surface at a place that has this one by the samples around it.
INLINE vec normal_there(vec point, vec blended, mask active, world w) { return blended; }

// Cuts a ray to the part that planes leave; the lanes that have one.
INLINE mask planes_leave(ray *r, world w) { return equal(R(0.0), R(0.0)); }

// The same for a ray from the eye; the result says where it meets the face of a plane that opens the set, and is no longer `active`.
INLINE mask face_met(ray *r, mask *active, plane_face *face, world w) { return *active & ~*active; }

typedef struct {
    int none;
} quads;

INLINE quads quads_ahead(ray r, mask wanted, world w) { return (quads){0}; }

// Adds those that are left before distance `until`, one after the other.
INLINE void sight_quads(sight *s, real until, mask active, quads *q, world w) {}

// Puts them into a sample at a surface.
INLINE pixel_sample quads_over(pixel_sample s, ray r, const sight *e, color background, real time, mask wanted, world w) { return s; }
