// Entry point of the cut-plane renderer: one work-item renders LANES pixels of a tile, one evaluation for each sample.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "sampling.h"
#include "color.h"
#include "tiles.h"
#include "pixel.h"
#include "escape.h"
#include "escape_colors.h"

__kernel void cut_plane(__global float *film, __global uint *statistics, __global const int2 *corners,
                        __constant const struct View *view, __constant const struct PlaneSamples *settings,
                        __constant const struct Orbit *orbit, __constant const scalar *k,
                        __constant const struct EscapeColors *colors, __global const float *palette,
                        __constant const int *slots, int channel_count, int first_packet) {
    const int packet = (int)get_global_id(0) + first_packet;
    const int tile = (int)get_global_id(1);
    const packet_pixels at = packet_at(packet, corners[tile], view);
    const real from_center_x = at.x - (real)(view->center_x), from_center_y = at.y - (real)(view->center_y);
    pixel p = pixel_start();
    real applications = R(0.0);
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
        const vec right = vec_splat(view->right), down = vec_splat(view->down);
        shot s;
        s.point = vec_along(vec_along(vec_splat(view->center), from_center_x + across, right), from_center_y + below, down);
        const escaped e = plane_escape(s.point, active, SMOOTH, settings->periodicity, orbit, k);
        s.radiance = escape_color(e, colors, palette);
        s.hit = active;
        s.coverage = R(1.0);
        s.depth = R(0.0);
        s.normal = vec_scale(vec_splat(view->axis), R(-1.0));
        s.smooth = e.count;
        s.steps = e.applications;
        applications += pick(active, e.applications, R(0.0));
        pixel_add(&p, s, active, across * across + below * below);
#if ADAPTIVE
        noise_add(&p, s, active);
        // Lane by lane: a pixel's samples must not depend on its neighbours in the packet.
        if (sample + 1 >= settings->min_samples && (sample & 3) == 3) {
            active &= less((real)(settings->noise), noise_of(&p, 0));
        }
#endif
    }
    pixel_write(film + tile * channel_count * TILE_PIXELS, slots, at.place, &p);

    // Per packet: samples, evaluations, formula applications; none is ever bad.
    statistics += 4 * (tile * (TILE_PIXELS / LANES) + packet);
    statistics[0] = (uint)lanes_sum(p.shots);
    statistics[1] = (uint)lanes_sum(p.shots);
    statistics[2] = (uint)lanes_sum(applications);
    statistics[3] = 0;
}
