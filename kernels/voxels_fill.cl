// The values of all voxels of bricks. One work-item takes ITEM_VOXELS of a brick.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "voxels.h"

#if FILL_KIND == FILL_ITERATIONS
// Smooth escape counts as `orbit_dual_distance` and `smooth_count` find them, without derivatives.
INLINE real solid_count(vec point, __constant const struct Orbit *orbit, __constant const scalar *k) {
    state c, z;
    start(point, k, &c, &z);
    surface_point end;
    end.square = state_square(z);
    end.square_before = end.square;
    real count = (real)((scalar)FIRST_COUNT);
    mask alive = less_equal(end.square, (real)(orbit->distance_square));
    mask inside = alive & ~alive;
    for (int n = FIRST_COUNT; n < orbit->longest; ++n) {
        if (n == orbit->iterations) {
            inside = alive & settled(end.square, orbit);
            alive &= ~inside;
        }
        if (!any_lane(alive)) break;
        const state next = apply(n, z, c, k);
        z = state_pick(alive, next, z);
        end.square_before = pick(alive, end.square, end.square_before);
        end.square = pick(alive, state_square(next), end.square);
        count = pick(alive, (real)((scalar)(n + 1)), count);
        alive &= less_equal(end.square, (real)(orbit->distance_square));
    }
    if (orbit->longest <= orbit->iterations) inside |= alive & settled(end.square, orbit);
#if HAS_SHAPE
    inside = less_equal(solid_distance(z, k), R(0.0));
#endif
    const sphere found = {R(0.0), count, inside};
    return clamp(smooth_count(found, end, orbit), R(0.0), (real)((scalar)orbit->iterations));
}
#endif

// The values of a packet's points, 0 to 1 for a share, else as they are.
INLINE real packet_values(ulong place, int first, __global const scalar *axes, __constant const struct Lattice *lattice,
                          __constant const struct Orbit *orbit, __constant const scalar *k) {
#if FILL_KIND == FILL_COVERAGE
    const int n = lattice->sub_points;
    real sum = R(0.0);
    for (int sub_z = 0; sub_z < n; ++sub_z) {
        for (int sub_y = 0; sub_y < n; ++sub_y) {
            for (int sub_x = 0; sub_x < n; ++sub_x) {
                const vec point = voxel_points(place, first, (int3)(sub_x, sub_y, sub_z), axes, lattice);
                sum += pick(solid_inside(point, orbit, k), R(1.0), R(0.0));
            }
        }
    }
    return sum / (real)((scalar)(n * n * n));
#elif FILL_KIND == FILL_ITERATIONS
    return solid_count(voxel_points(place, first, (int3)(0), axes, lattice), orbit, k);
#else
    const vec point = voxel_points(place, first, (int3)(0), axes, lattice);
    return pick(solid_inside(point, orbit, k), R(1.0), R(0.0));
#endif
}

// samples: of each brick its voxels, x fastest; of FILL_INSIDE a bit each. `scale`: of a value that is kept in 8 bits.
__kernel void fill_bricks(__global SAMPLE *samples, __global const ulong *bricks, int first, float scale,
                          __global const scalar *axes, __constant const struct Lattice *lattice,
                          __constant const struct Orbit *orbit, __constant const scalar *k) {
    const size_t brick = (size_t)first + get_global_id(1);
    const int item = (int)get_global_id(0) * ITEM_VOXELS;
    const ulong place = bricks[brick];
#if FILL_KIND == FILL_INSIDE
    uint bits = 0;
    for (int part = 0; part < ITEM_VOXELS; part += LANES) {
        const vec point = voxel_points(place, item + part, (int3)(0), axes, lattice);
        bits |= lanes_bits(solid_inside(point, orbit, k)) << part;
    }
    __global uchar *rows = samples + (brick * BRICK_VOXELS + item) / 8;
    for (int row = 0; row < ITEM_VOXELS / 8; ++row) rows[row] = (uchar)(bits >> (8 * row));
#else
    __global SAMPLE *values = samples + brick * BRICK_VOXELS + item;
    for (int part = 0; part < ITEM_VOXELS; part += LANES) {
        scalar each[LANES];
        lanes_store(packet_values(place, item + part, axes, lattice, orbit, k), each);
        for (int lane = 0; lane < LANES; ++lane) {
#if SAMPLE_BYTES == 1
            values[part + lane] = convert_uchar_sat_rte((float)each[lane] * scale);
#else
            values[part + lane] = (float)each[lane];
#endif
        }
    }
#endif
}
