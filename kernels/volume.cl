// Entry point of the volume renderer: rays through a grid of voxels.
//
// A ray looks at the grid at places that lie a fixed step apart, counted from where it enters the grid: skipping empty nodes
// leaves out places, and never moves them. SURFACE shows the boundary where the value passes `level`; otherwise places are
// composited from front to back, until the ray is opaque.
//
// From the build: formula.h and orbit.h, empty where nothing asks the formula; volume_normals.h, whose normals surfaces have.
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
#if PLANES > 0
#include "escape.h"
#include "escape_colors.h"
#include "planes.h"
INLINE mask cut_objects_hold(int plane, vec point, plane_set set) { return less(R(1.0), R(0.0)); }
#include "planes_seen.h"
#endif

#if VALUE_IS_FLOAT
typedef float sample;
#else
typedef uchar sample;
#endif
#include "grid.h"
#if HAS_PATHS
#include "environment.h"
#endif
#include "volume_ray.h"
#include "volume_light.h"
#include "volume_normals.h"
#include "volume_sight.h"
#include "volume_shot.h"
#if HAS_PATHS
#include "sky.h"
// Beside a grid are neither objects that shine nor lights on a set.
INLINE mask met_on_set(vec origin, vec direction, int of_eye, real *far, color *shows, real *density, real *weight, world w) { return less(R(1.0), R(0.0)); }
#include "light_places.h"
#include "lights.h"
INLINE real with_lights_beside(real sum, vec point, real own, world w) { return sum; }
INLINE void lights_beside_asked(choosing *c, const real *numbers, world w) {}
#include "light_asks.h"
#include "volume_paths.h"
#endif

INLINE shot sample_shot(const packet_pixels *at, real across, real below, int sample, mask active, world w, tally *cost) {
    real lens_x = R(0.0), lens_y = R(0.0), time = R(0.0);
    if (w.view->has_lens) {
        const bits seed = pixel_seed(at->columns, at->rows, (uint)w.sampling->seed, PURPOSE_LENS);
        unit_square((bits)((uint)sample), seed, &lens_x, &lens_y);
        unit_disk(lens_x, lens_y, &lens_x, &lens_y);
    }
    if (w.view->spans > 0) time = shutter_time(at->columns, at->rows, (uint)w.sampling->seed, sample);
#if HAS_PATHS
    return take_path(at, at->x + across, at->y + below, lens_x, lens_y, time, sample, active, w, &cost->steps);
#else
    return take_shot(at->x + across, at->y + below, lens_x, lens_y, time, active, w, &cost->steps);
#endif
}

#include "packets.h"

__kernel void volume(PASS_BUFFERS, __constant const struct Volume *settings, __constant const struct Grid *about,
                     __constant const struct Material *material, __constant const struct Light *lights,
                     __global const float *transfer, __global const int *table, __global const int *blocks,
                     __global const sample *values0, __global const sample *values1, __global const sample *values2,
                     __global const sample *values3, __global const uchar *normals0, __global const uchar *normals1,
                     __global const uchar *normals2, __global const uchar *normals3,
                     __constant const struct Orbit *orbits, __constant const scalar *k,
#if HAS_PATHS
                     __global const float *bounds, __global const float *environment,
#endif
#if PLANES > 0
                     __global const struct CutPlane *planes, __global const float *plane_palettes,
#endif
                     PASS_SPAN) {
    const world w = {view, settings, material, lights, transfer,
                     {about, table, blocks, {values0, values1, values2, values3}, {normals0, normals1, normals2, normals3}},
                     sampling, orbits, k
#if HAS_PATHS
                     , bounds, environment
#endif
#if PLANES > 0
                     , {planes, orbits, k, plane_palettes, 0, PLANES}
#endif
    };
    const pass span = PASS;
    render_packet((int)get_global_id(0) + first_packet, (int)get_global_id(1), span, w);
}
