// The escape counts of the voxels of bricks. One work-item takes ITEM_VOXELS of a brick.
#include "voxels.h"
#include "solid_count.h"

// As `cover_bricks`, but that all octants are looked at.
FILL(count_bricks) {
    FILL_BEGINS(brick, item);
    for (int part = 0; part < ITEM_VOXELS; part += LANES) {
        mask inside;
        const vec points = voxel_points(bricks[brick], item + part, (int4)(0), axes, lattice);
        keep_values(samples, brick, item + part, solid_count(points, &inside, orbit, k), floats, scale);
    }
}
