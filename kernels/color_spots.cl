// Entry point that knows the formula: what chooses the colour of spots, where that asks the formula.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "camera.h"
#include "sampling.h"
#include "shade.h"
#include "tiles.h"
#include "pixel.h"
#include "coloring.h"
#include "planes.h"
#include "stage.h"
#include "state.h"
#if ASKED > 0
#include "asked.h"
#endif
#include "eye.h"

#define COLORING_ASKS (COLORING == COLORING_THICKNESS || COLORING == COLORING_LAYER_DISTANCE || COLORING == COLORING_TRAP)

STAGE(color_spots) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    spot here = spot_kept(s.state, bounce, s.stride);
    const mask found = mask_of(here.found) & of_the_set(OBJECT_OF(here), w);
    if (!any_lane(found)) return;
    path so_far;
    const aim a = aim_kept(s.state, s.stride);
    const vec direction = path_ray(s, eye_ray(&a, view), a.wanted, &so_far).direction;
#if ASKED > 0
    for (int i = 0; i < ASKED; ++i) {
        // After the scene's own record.
        const real answer = asked_quantity(&here, found, material + 1 + i, orbit, k);
        numbers_keep(&answer, 1, s.state + STATE_ASKED(i) * s.stride, s.stride);
    }
#endif
#if COLORING_ASKS
    here.quantity = coloring_quantity(here.point, here.normal, direction, here.cone, here.smooth, here.residual, found,
                                      material, orbit, k);
    spot_keep(&here, s.state, bounce, s.stride);
#endif
}
