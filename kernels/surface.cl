// Entry point of the surface renderer: shaded pixels, with all data channels.

#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "rays.h"
#if SEARCH == SEARCH_STEPS
#include "march_steps.h"
#else
#include "march_state.h"
#include "proof.h"
#include "march.h"
#endif
#include "batch.h"
#include "sampling.h"
#include "shade.h"
#include "tiles.h"
#include "pixel.h"
#include "normals.h"
#include "coloring.h"
#if HAS_ENVIRONMENT
#include "environment.h"
#endif
#if PLANES > 0
#include "escape.h"
#include "escape_colors.h"
#include "planes.h"
#endif
#include "spot.h"
#include "pixel_points.h"
#include "secondary.h"
#include "shot.h"

INLINE shot sample_shot(const packet_pixels *at, real across, real below, int sample, mask active, world w, tally *cost) {
    return take_shot(at->x + across, at->y + below, sample, at->columns, at->rows, active, w, cost);
}

#include "passes.h"

__kernel void surface(PASS_BUFFERS, __constant const struct March *settings, __constant const struct Orbit *orbit,
                      __constant const scalar *k, __constant const struct Material *material,
                      __constant const struct Light *lights, __global const float *palette,
                      __global const float *environment,
#if PLANES > 0
                      __global const struct CutPlane *planes, __global const float *plane_palettes,
#endif
                      PASS_SPAN) {
#if PLANES > 0
    const world w = {view, settings, orbit, k, material, lights, palette, environment, {planes, orbit, k, plane_palettes}};
#else
    const world w = {view, settings, orbit, k, material, lights, palette, environment};
#endif
    const pass span = PASS;
    render_packet(span, w);
}
