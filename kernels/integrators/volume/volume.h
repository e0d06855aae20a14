// What the entry points of the volume renderer begin with: rays through a grid of voxels.
//
// A ray looks at the grid at places that lie a fixed step apart, counted from where it enters the grid: skipping empty nodes
// leaves out places, and never moves them.
#include "integrators/pictures.h"
#include "voxels/grid.h"
#include "integrators/volume/volume_ray.h"
#include "integrators/packets.h"

// The ray of a sample, and its place in the shutter's time.
INLINE ray sample_ray(const packet_pixels *at, real across, real below, int sample, world w, real *time) {
    real lens_x, lens_y;
    sample_of_lens(at, sample, (uint)w.sampling->seed, w.view, &lens_x, &lens_y, time);
    return camera_ray(at->x + across, at->y + below, lens_x, lens_y, *time, w.view);
}

// The kernel of an entry point: all have the same arguments.
#define VOLUME(name)                                                                                                        \
    __kernel void name(PASS_BUFFERS, __constant const struct Volume *settings, __constant const struct Grid *about,         \
                       material_record material, light_record lights,                   \
                       __global const float *transfer, __global const int *table, __global const int *blocks,               \
                       __global const uchar *values0, __global const uchar *values1, __global const uchar *values2,         \
                       __global const uchar *values3, __global const uchar *normals0, __global const uchar *normals1,       \
                       __global const uchar *normals2, __global const uchar *normals3,                                      \
                       orbit_record orbits, constants k, __global const float *bounds,     \
                       __global const float *environment, __global const float *tables, plane_record planes,               \
                       __global const float *plane_palettes, PASS_SPAN) {                                                   \
        const grid voxels = {about, table, blocks, {values0, values1, values2, values3}, {normals0, normals1, normals2, normals3}}; \
        const plane_set set = {planes, orbits, k, plane_palettes, 0, settings->plane_count};                                \
        const world w = {view, settings, material, lights, transfer, voxels, sampling, orbits, k, bounds, environment, tables, set}; \
        const pass span = PASS;                                                                                             \
        render_packet((int)get_global_id(0) + first_packet, (int)get_global_id(1), span, w);                                \
    }
