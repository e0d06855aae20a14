// Which voxels of bricks are inside. One work-item takes ITEM_VOXELS of a brick.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "solids.h"
#include "voxels.h"

// samples: of each brick a bit for each of its voxels. `known`: two bytes of each brick, which of its octants hold nothing, and which
// nothing else.
__kernel void fill_bricks(__global uchar *samples, __global const ulong *bricks, int first, __global const uchar *known,
                          int floats, float scale, __global const scalar *axes, __constant const struct Lattice *lattice,
                          __constant const struct Orbit *orbit, __constant const scalar *k) {
    if (orbit_cancelled(orbit)) return;
    const size_t brick = (size_t)first + get_global_id(1);
    const int item = (int)get_global_id(0) * ITEM_VOXELS;
    const ulong place = bricks[brick];
    const int octant = item / OCTANT_VOXELS;
    const bool empty = ((known[2 * brick] >> octant) & 1) != 0, full = ((known[2 * brick + 1] >> octant) & 1) != 0;
    uint bits = full ? 0xffffffffu : 0u;
    for (int part = 0; part < ITEM_VOXELS && !empty && !full; part += LANES * PACKETS) {
        vec points[PACKETS];
        mask inside[PACKETS];
        #pragma unroll
        for (int p = 0; p < TURNS(PACKETS); ++p) points[p] = voxel_points(place, item + part + p * LANES, (int4)(0), axes, lattice);
        solid_inside(points, inside, orbit, k);
        #pragma unroll
        for (int p = 0; p < TURNS(PACKETS); ++p) bits |= lanes_bits(inside[p]) << (part + p * LANES);
    }
    __global uchar *bytes = samples + (brick * BRICK_VOXELS + item) / 8;
    for (int i = 0; i < ITEM_VOXELS / 8; ++i) bytes[i] = (uchar)(bits >> (8 * i));
}
