// The values of all voxels of bricks. One work-item takes ITEM_VOXELS of a brick.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "solids.h"
#include "voxels.h"

#if FILL_KIND == FILL_ITERATIONS
#include "solid_count.h"
#endif

// The values of PACKETS packets from voxel `first` on: 0 to 1 for a share, else as they are.
INLINE void packet_values(ulong place, int first, real *values, __global const scalar *axes,
                          __constant const struct Lattice *lattice, __constant const struct Orbit *orbit,
                          __constant const scalar *k) {
#if FILL_KIND == FILL_ITERATIONS
    for (int p = 0; p < TURNS(PACKETS); ++p) {
        mask inside;
        values[p] = solid_count(voxel_points(place, first + p * LANES, (int4)(0), axes, lattice), &inside, orbit, k);
    }
#else
    const int n = FILL_KIND == FILL_COVERAGE ? lattice->sub_points : 1;
    for (int p = 0; p < TURNS(PACKETS); ++p) values[p] = R(0.0);
    for (int sub = 0; sub < n * n * n; ++sub) {
        const int4 sub_point = (int4)(sub % n, sub / n % n, sub / (n * n), 0);
        vec points[PACKETS];
        mask inside[PACKETS];
        #pragma unroll
        for (int p = 0; p < TURNS(PACKETS); ++p) points[p] = voxel_points(place, first + p * LANES, sub_point, axes, lattice);
        solid_inside(points, inside, orbit, k);
        #pragma unroll
        for (int p = 0; p < TURNS(PACKETS); ++p) values[p] += pick(inside[p], R(1.0), R(0.0));
    }
    for (int p = 0; p < TURNS(PACKETS); ++p) values[p] /= (real)((scalar)(n * n * n));
#endif
}

// samples: of each brick its voxels; of FILL_INSIDE a bit each. `known`: two bytes of each brick, which of its octants hold
// nothing, and which nothing else. `scale`: of a value that is kept in 8 bits.
__kernel void fill_bricks(__global SAMPLE *samples, __global const ulong *bricks, int first, __global const uchar *known,
                          float scale, __global const scalar *axes, __constant const struct Lattice *lattice,
                          __constant const struct Orbit *orbit, __constant const scalar *k) {
    if (orbit_cancelled(orbit)) return;
    const size_t brick = (size_t)first + get_global_id(1);
    const int item = (int)get_global_id(0) * ITEM_VOXELS;
    const ulong place = bricks[brick];
    const int octant = item / OCTANT_VOXELS;
    const bool empty = ((known[2 * brick] >> octant) & 1) != 0, full = ((known[2 * brick + 1] >> octant) & 1) != 0;
#if FILL_KIND == FILL_INSIDE
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
#else
    __global SAMPLE *values = samples + brick * BRICK_VOXELS + item;
    for (int part = 0; part < ITEM_VOXELS; part += LANES * PACKETS) {
        real found[PACKETS];
        for (int p = 0; p < TURNS(PACKETS); ++p) found[p] = full ? R(1.0) : R(0.0);
        if (!empty && !full) packet_values(place, item + part, found, axes, lattice, orbit, k);
        for (int p = 0; p < TURNS(PACKETS); ++p) {
            scalar each[LANES];
            lanes_store(found[p], each);
            for (int lane = 0; lane < LANES; ++lane) {
#if SAMPLE_BYTES == 1
                values[part + p * LANES + lane] = convert_uchar_sat_rte((float)each[lane] * scale);
#else
                values[part + p * LANES + lane] = (float)each[lane];
#endif
            }
        }
    }
#endif
}
