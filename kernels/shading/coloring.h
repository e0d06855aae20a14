// The quantities that the formula is asked for, for a colour's place in the palette (by a material's `coloring`) or a map. Such a kind is
// a file of `elements/colorings/answers` with this function:
//   real NAME_answer(vec point, vec normal, vec view_direction, real cone, mask active, material_record material, orbit_record orbit,
//                    constants k)
// `view_direction` leads from the viewer to the point, and has length 1 as the normal; `cone` is the footprint there. In scene units, a
// trap's in those of z.

#include "shading/ways.h"
#include "formulas/orbit_told.h"
#include "elements/colorings"
#include "elements/colorings/answers"

#define ANSWER(KIND, name) case COLORING_##KIND: return name##_answer(point, normal, view_direction, cone, active, material, orbit, k);
INLINE real coloring_quantity(vec point, vec normal, vec view_direction, real cone, mask active, material_record material,
                              orbit_record orbit, constants k) {
    switch (material->coloring) { ANSWERS(ANSWER) default: return R(0.0); }
}
