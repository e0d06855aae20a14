// Which parts of stored bricks may be seen: a bit for each block of 2 x 2 x 2 cells; and the values in each. One work-item takes one brick.
#include "device/direct.h"
#include "voxels/bricks.h"

// A stored value, as it is kept.
float value_at(__global const uchar *values, size_t at, int floats) {
    return floats ? ((__global const float *)values)[at] : (float)values[at];
}

// Of the bricks from `first` on, in slots from `slot` on: whether any sample of a block is above `unseen` (or not a number).
// Bits of z < 4 first, of y < 4 before others, then of x < 4: eight bits for each octant of 4 x 4 x 4 cells, x fastest.
__kernel void seen_blocks(__global uint2 *blocks, __global const uchar *values, int first, int count, int slot, int floats, float unseen) {
    const int brick = first + (int)get_global_id(1);
    if (brick >= count) return;
    size_t at = (size_t)brick * BRICK_STRIDE;
    ulong bits = 0;
    for (int z = 0; z < BRICK_SIDE; ++z) {
        for (int y = 0; y < BRICK_SIDE; ++y) {
            uint nine = 0;
            for (int x = 0; x < BRICK_SIDE; ++x) {
                const uint seen = value_at(values, at + x, floats) <= unseen ? 0u : 1u;
                nine |= seen << x;
            }
            at += BRICK_SIDE;
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

// The least and the largest sample of the bricks from `first` on, in slots from `slot` on; everything, if one is not a number.
__kernel void brick_ranges(__global float2 *ranges, __global const uchar *values, int first, int count, int slot, int floats) {
    const int brick = first + (int)get_global_id(1);
    if (brick >= count) return;
    const size_t start = (size_t)brick * BRICK_STRIDE;
    float low = INFINITY, high = -INFINITY;
    int unknown = 0;
    for (int i = 0; i < BRICK_SIDE * BRICK_SIDE * BRICK_SIDE; ++i) {
        const float one = value_at(values, start + i, floats);
        unknown |= one != one;
        low = fmin(low, one);
        high = fmax(high, one);
    }
    ranges[slot + brick] = unknown ? (float2)(-INFINITY, INFINITY) : (float2)(low, high);
}
