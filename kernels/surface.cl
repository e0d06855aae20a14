// Entry point of the surface renderer: one work-item renders LANES pixels of a tile, shaded and with all data channels.

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

__kernel void surface(__global float *film, __global uint *statistics, __global const int2 *corners,
                      __constant const struct View *view, __constant const struct March *settings,
                      __constant const struct Orbit *orbit, __constant const scalar *k,
                      __constant const struct Material *material, __constant const struct Light *lights,
                      __global const float *palette, __global const float *environment,
#if PLANES > 0
                      __constant const struct CutPlane *planes, __global const float *plane_palettes,
#endif
                      __constant const int *slots, int channel_count, int first_packet) {
    const int packet = (int)get_global_id(0) + first_packet;
    const int tile = (int)get_global_id(1);
#if PLANES > 0
    const world w = {view, settings, orbit, k, material, lights, palette, environment, {planes, orbit, k, plane_palettes}};
#else
    const world w = {view, settings, orbit, k, material, lights, palette, environment};
#endif
    const packet_pixels at = packet_at(packet, corners[tile], view);
    pixel p = pixel_start();
    tally cost = {R(0.0), R(0.0), R(0.0)};
    mask active = at.in_region;
    for (int sample = 0; sample < settings->samples; ++sample) {
        if (!any_lane(active)) break;
        // One sample lies in the middle.
        real across = R(0.0), below = R(0.0);
        if (settings->samples > 1) {
            real u, v;
            unit_square((bits)((uint)sample), pixel_seed(at.columns, at.rows, (uint)settings->seed, PURPOSE_PIXEL), &u, &v);
            filter_offset(u, v, settings->filter, (real)(settings->filter_width), &across, &below);
        }
        const shot s = take_shot(at.x + across, at.y + below, sample, at.columns, at.rows, active, w, &cost);
        pixel_add(&p, s, active, across * across + below * below);
#if ADAPTIVE
        noise_add(&p, s, active);
        // Lane by lane: a pixel's samples must not depend on its neighbours in the packet.
        if (sample + 1 >= settings->min_samples && (sample & 3) == 3) {
            active &= less((real)(settings->noise), noise_of(&p, material->transparent));
        }
#endif
    }

    pixel_write(film + tile * channel_count * TILE_PIXELS, slots, at.place, &p);

    // Per packet: rays, distance evaluations, formula applications, steps that ended inside.
    statistics += 4 * (tile * (TILE_PIXELS / LANES) + packet);
    statistics[0] = (uint)lanes_sum(p.shots);
    statistics[1] = (uint)lanes_sum(cost.steps);
    statistics[2] = (uint)lanes_sum(cost.count);
    statistics[3] = (uint)lanes_sum(cost.bad);
}
