// Entry point of the volume renderer: one work-item renders LANES pixels of a tile by rays through a grid of voxels.
//
// A ray looks at the grid at places that lie a fixed step apart, counted from where it enters the grid: skipping empty nodes
// leaves out places, and never moves them. SURFACE shows the boundary where the value passes `level`; otherwise places are
// composited from front to back, until the ray is opaque.
#include "lanes.h"
#if PLANES > 0
#include "numbers/real.h"
#include "numbers/dual.h"
#endif
#include "vectors.h"
#include "structs.h"
#if PLANES > 0
#include "formula.h"
#include "orbit.h"
#endif
#include "camera.h"
#include "sampling.h"
#include "shade.h"
#include "tiles.h"
#include "pixel.h"
#if PLANES > 0
#include "escape.h"
#include "escape_colors.h"
#include "planes.h"
#endif

#if VALUE_IS_FLOAT
typedef float sample;
#else
typedef uchar sample;
#endif
#include "grid.h"
#include "volume_ray.h"
#include "volume_shot.h"

__kernel void volume(__global float *film, __global uint *statistics, __global const int2 *corners,
                     __constant const struct View *view, __constant const struct Volume *settings,
                     __constant const struct Grid *about, __constant const struct Material *material,
                     __constant const struct Light *lights, __global const float *transfer, __global const int *table, __global const int *blocks,
                     __global const sample *values0, __global const sample *values1, __global const sample *values2,
                     __global const sample *values3, __global const uchar *normals0, __global const uchar *normals1,
                     __global const uchar *normals2, __global const uchar *normals3,
#if PLANES > 0
                     __constant const struct CutPlane *planes, __constant const struct Orbit *orbits,
                     __constant const scalar *k, __global const float *plane_palettes,
#endif
                     __constant const int *slots, int channel_count, int first_packet) {
    const int packet = (int)get_global_id(0) + first_packet;
    const int tile = (int)get_global_id(1);
    const world w = {view, settings, material, lights, transfer,
                     {about, table, blocks, {values0, values1, values2, values3}, {normals0, normals1, normals2, normals3}}
#if PLANES > 0
                     , {planes, orbits, k, plane_palettes}
#endif
    };
    const packet_pixels at = packet_at(packet, corners[tile], view);
    pixel p = pixel_start();
    real steps = R(0.0);
    mask active = at.in_region;
    for (int sample_number = 0; sample_number < settings->samples; ++sample_number) {
        if (!any_lane(active)) break;
        real across = R(0.0), below = R(0.0), lens_x = R(0.0), lens_y = R(0.0);
        const bits index = (bits)((uint)sample_number);
        if (settings->samples > 1) {
            real u, v;
            unit_square(index, pixel_seed(at.columns, at.rows, (uint)settings->seed, PURPOSE_PIXEL), &u, &v);
            filter_offset(u, v, settings->filter, (real)(settings->filter_width), &across, &below);
        }
#if HAS_LENS
        unit_square(index, pixel_seed(at.columns, at.rows, (uint)settings->seed, PURPOSE_LENS), &lens_x, &lens_y);
        unit_disk(lens_x, lens_y, &lens_x, &lens_y);
#endif
        const shot s = take_shot(at.x + across, at.y + below, lens_x, lens_y, active, w, &steps);
        pixel_add(&p, s, active, across * across + below * below);
#if ADAPTIVE
        noise_add(&p, s, active);
        if (sample_number + 1 >= settings->min_samples && (sample_number & 3) == 3) {
            active &= less((real)(settings->noise), noise_of(&p, material->transparent));
        }
#endif
    }
    pixel_write(film + tile * channel_count * TILE_PIXELS, slots, at.place, &p);
    statistics += 4 * (tile * (TILE_PIXELS / LANES) + packet);
    statistics[0] = (uint)lanes_sum(p.shots);
    statistics[1] = (uint)lanes_sum(steps);
    statistics[2] = 0;
    statistics[3] = 0;
}
