// The escape counts of the voxels of bricks. One work-item takes ITEM_VOXELS of a brick.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "solids.h"
#include "voxels.h"
#include "solid_count.h"

// As `cover_bricks`, but that all octants are looked at.
FILL(count_bricks) {
    if (orbit_cancelled(orbit)) return;
    const size_t brick = FILLED_BRICK;
    const int item = FILLED_VOXEL;
    for (int part = 0; part < ITEM_VOXELS; part += LANES) {
        mask inside;
        const vec points = voxel_points(bricks[brick], item + part, (int4)(0), axes, lattice);
        keep_values(samples, brick, item + part, solid_count(points, &inside, orbit, k), floats, scale);
    }
}
