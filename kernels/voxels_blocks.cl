// Which parts of stored bricks may be seen: a bit for each block of 2 x 2 x 2 cells. One work-item takes one brick.
//
// From the build: VALUE, the type of a stored value.
#include "direct.h"

#define BRICK_SIDE 9
#define BRICK_STRIDE 736

// Of the bricks from `first` on, in slots from `slot` on: whether any sample of a block is above `unseen` (or not a number).
// Bits of z < 4 first, of y < 4 before others, then of x < 4: eight bits for each octant of 4 x 4 x 4 cells, x fastest.
__kernel void seen_blocks(__global uint2 *blocks, __global const VALUE *values, int first, int count, int slot, float unseen) {
    const int brick = first + (int)get_global_id(1);
    if (brick >= count) return;
    __global const VALUE *value = values + (size_t)brick * BRICK_STRIDE;
    ulong bits = 0;
    for (int z = 0; z < BRICK_SIDE; ++z) {
        for (int y = 0; y < BRICK_SIDE; ++y) {
            uint nine = 0;
            for (int x = 0; x < BRICK_SIDE; ++x) {
                const uint seen = (float)value[x] <= unseen ? 0u : 1u;
                nine |= seen << x;
            }
            value += BRICK_SIDE;
            const uint three = nine | nine >> 1 | nine >> 2;
            const uint four = (three & 1) | (three >> 1 & 2) | (three >> 2 & 4) | (three >> 3 & 8);
            // Samples between two blocks belong to both.
            for (int k = max(z - 1, 0) >> 1; k <= min(z >> 1, 3); ++k) {
                for (int j = max(y - 1, 0) >> 1; j <= min(y >> 1, 3); ++j) {
                    const int shift = (k >> 1) * 32 + (k & 1) * 4 + (j & 1) * 2 + (j >> 1) * 16;
                    bits |= (ulong)((four & 3) | (four >> 2) << 8) << shift;
                }
            }
        }
    }
    blocks[slot + brick] = (uint2)((uint)bits, (uint)(bits >> 32));
}
