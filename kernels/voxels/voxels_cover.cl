// How much of each voxel of bricks is inside. One work-item takes ITEM_VOXELS of a brick.
#include "voxels/voxels.h"

// The shares of PACKETS packets from voxel `first` on that are inside, 0 to 1: of their sub-points.
INLINE void packet_shares(ulong place, int first, real *shares, __global const scalar *axes, __constant const struct Lattice *lattice,
                          orbit_record orbit, constants k) {
    const int n = lattice->sub_points;
    for (int p = 0; p < TURNS(PACKETS); ++p) shares[p] = R(0.0);
    int4 sub_point = (int4)(0);
    for (int sub = 0; sub < n * n * n; ++sub) {
        vec points[PACKETS];
        mask inside[PACKETS];
        #pragma unroll
        for (int p = 0; p < TURNS(PACKETS); ++p) points[p] = voxel_points(place, first + p * LANES, sub_point, axes, lattice);
        solid_inside(points, inside, orbit, k);
        #pragma unroll
        for (int p = 0; p < TURNS(PACKETS); ++p) shares[p] += pick(inside[p], R(1.0), R(0.0));
        sub_point.x += 1;
        if (sub_point.x == n) sub_point = (int4)(0, sub_point.y + 1, sub_point.z, 0);
        if (sub_point.y == n) sub_point = (int4)(0, 0, sub_point.z + 1, 0);
    }
    for (int p = 0; p < TURNS(PACKETS); ++p) shares[p] /= (real)((scalar)(n * n * n));
}

FILL(cover_bricks) {
    FILL_BEGINS(brick, place, item, empty, full);
    for (int part = 0; part < ITEM_VOXELS; part += LANES * PACKETS) {
        real found[PACKETS];
        for (int p = 0; p < TURNS(PACKETS); ++p) found[p] = full ? R(1.0) : R(0.0);
        if (!empty && !full) packet_shares(place, item + part, found, axes, lattice, orbit, k);
        for (int p = 0; p < TURNS(PACKETS); ++p) keep_values(samples, brick, item + part + p * LANES, found[p], floats, scale);
    }
}
