// Which voxels of bricks are inside. One work-item takes ITEM_VOXELS of a brick.
#include "voxels/voxels.h"

FILL(fill_bricks) {
    FILL_BEGINS(brick, place, item, empty, full);
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
