// The escape counts of the voxels of bricks. One work-item takes ITEM_VOXELS of a brick.
#include "voxels/voxels.h"
#include "formulas/escape.h"

// As `cover_bricks`, but that all octants are looked at.
FILL(count_bricks) {
    FILL_BEGINS(brick, place, item, empty, full);
    for (int part = 0; part < ITEM_VOXELS; part += LANES) {
        const vec points = voxel_points(place, item + part, (int4)(0), axes, lattice);
        const escaped e = plane_escape(points, equal(R(0.0), R(0.0)), 1, 1, orbit->iterations, orbit, k);
        keep_values(samples, brick, item + part, clamp(e.count, R(0.0), (real)((scalar)orbit->iterations)), floats, scale);
    }
}
