// Voxels as the fill evaluates them: bricks of 8 x 8 x 8, each voxel in one brick only (stored bricks have a ninth layer).
#include "formulas/orbits.h"
#include "voxels/bricks.h"
#include "formulas/solid_inside.h"

// Voxels are in the order of a brick's octants, 4 x 4 x 4 (x fastest, in and between them): packets that are compact end
// together, and octants can be left out.
// Voxels of a work-item, 8 at least: of the bits that are stored for them no two work-items share a byte.
#define ITEM_VOXELS (LANES * PACKETS < 8 ? 8 : LANES * PACKETS)

// The points of voxels `first` and those after it in a brick: coordinates are looked up, because they are found in float64
// and rounded once. `axes` has x, then y, then z; each has its sub-points' coordinates one after the other.
INLINE vec voxel_points(ulong place, int first, int4 sub_point, __global const scalar *axes,
                        __constant const struct Lattice *lattice) {
    const int octant = first / OCTANT_VOXELS;
    __global const scalar *along_x = axes + sub_point.x * lattice->padded[0];
    __global const scalar *along_y = axes + lattice->sub_points * lattice->padded[0];
    __global const scalar *along_z = along_y + lattice->sub_points * lattice->padded[1];
    along_x += BRICK * PLACE_X(place) + 4 * (octant & 1);
    along_y += sub_point.y * lattice->padded[1] + BRICK * PLACE_Y(place) + 4 * ((octant >> 1) & 1);
    along_z += sub_point.z * lattice->padded[2] + BRICK * PLACE_Z(place) + 4 * (octant >> 2);
    scalar x[LANES], y[LANES], z[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const int at = first + lane;
        x[lane] = along_x[at & 3];
        y[lane] = along_y[(at >> 2) & 3];
        z[lane] = along_z[(at >> 4) & 3];
    }
    return vec_of(lanes_load(x), lanes_load(y), lanes_load(z));
}

// The entry points of the fill, over the parts of bricks: all have the same arguments.
// samples: of each brick its voxels, bits of them or values (see `keep_values`). `known`: two bytes of each brick, which of its octants
// hold nothing, and which nothing else.
#define FILL(name)                                                                                                               \
    __kernel void name(__global uchar *samples, __global const ulong *bricks, int first, __global const uchar *known, int floats, \
                       float scale, __global const scalar *axes, __constant const struct Lattice *lattice,                        \
                       orbit_record orbit, constants k)
// The head of each: the brick and the voxel of a work-item, and whether this one's octant is known to hold nothing, or nothing else.
#define FILL_BEGINS(brick, place, item, empty, full)                                    \
    if (orbit_cancelled(orbit)) return;                                                 \
    const size_t brick = (size_t)first + get_global_id(1);                              \
    const ulong place = bricks[brick];                                                  \
    const int item = (int)get_global_id(0) * ITEM_VOXELS, octant = item / OCTANT_VOXELS; \
    const bool empty = (known[2 * brick] >> octant & 1) != 0, full = (known[2 * brick + 1] >> octant & 1) != 0

// Keeps the values of a packet from voxel `first` on: as floats, or as bytes that are `scale` times as large.
INLINE void keep_values(__global uchar *samples, size_t brick, int first, real values, int floats, float scale) {
    scalar each[LANES];
    lanes_store(values, each);
    const size_t at = brick * BRICK_VOXELS + first;
    for (int lane = 0; lane < LANES; ++lane) {
        const float value = (float)each[lane];
        if (floats) ((__global float *)samples)[at + lane] = value;
        else samples[at + lane] = convert_uchar_sat_rte(value * scale);
    }
}
