// Which bricks are outside or inside as a whole. One work-item takes one brick.
//
// From the build besides what voxels_bricks.h needs: RADIUS 0, as no voxels around are asked for.
#include "structs.h"
#include "voxels/voxels_bricks.h"

// 0: no voxel of the brick, its ninth layer included, is in the solid; 1: all are, as a whole; 2: neither.
__kernel void classify_bricks(__global uchar *classes, __global const ulong *bricks, int first, int count,
                              __global const SAMPLE *samples, __global const int *numbers,
                              __constant const struct Extent *extent) {
    const size_t brick = (size_t)first + get_global_id(1);
    if (brick >= count) return;
    const near_bricks around = near_bricks_of(bricks[brick], numbers, extent);
#if SOURCE == SOURCE_BITS
    // For most bricks their own voxels are enough.
    __global const uchar *bytes = samples + brick * 64;
    uchar16 least = vload16(0, bytes), most = least;
    for (int i = 1; i < 4; ++i) {
        const uchar16 more = vload16(i, bytes);
        least &= more;
        most |= more;
    }
    const ulong2 some_set = as_ulong2(most), all_set = as_ulong2(least);
    if ((some_set.x | some_set.y) != 0 && (all_set.x & all_set.y) != ~0ul) {
        classes[brick] = 2;
        return;
    }
#endif
    neighbourhood n;
    load_neighbourhood(&n, samples, &around, extent);
    bool some = false, all = true;
    for (int z = 0; z < BRICK_SIDE; ++z) {
        for (int y = 0; y < BRICK_SIDE; ++y) {
            const row r = row_at(&n, y, z);
#if ALONE
            for (n.own = 0; n.own < BRICK_SIDE; ++n.own) {
                const float value = row_window(&r, 0);
                some |= value != 0.0f;
                all &= value >= (SOURCE == SOURCE_BITS ? 1.0f : extent->whole);
            }
#elif SOURCE == SOURCE_BITS
            const uint own = (r >> VOXELS_BEFORE) & 0x1ff;
            some |= own != 0;
            all &= own == 0x1ff;
#else
            float nine[16];
            vstore16(row_window(&r, 0), 0, nine);
            for (int x = 0; x < BRICK_SIDE; ++x) {
                some |= nine[x] != 0.0f;
                all &= nine[x] >= extent->whole;
            }
#endif
        }
        if (some && !all) break;
    }
    classes[brick] = all ? 1 : some ? 2 : 0;
}
