// Rows of voxels around a brick, out of the bricks that the fill evaluated or of a slab of a whole grid, and vectors of
// neighbouring voxels in them. Everything here is float: no formula is evaluated.
//
// From the build: SOURCE_BITS, SOURCE_BRICKS, SOURCE_SLAB and which of them SOURCE is; SAMPLE, what the source holds; ALONE,
// whether a work-item has one voxel's place of each row (for GPUs) instead of a vector of them (for processors).
// Voxels past the ends of the grid repeat the last one.
#include "device/direct.h"
#include "voxels/bricks.h"

#include "voxels/voxels_alone.h"

#if !ALONE
INLINE near_bricks near_bricks_of(ulong place, __global const int *numbers, __constant const struct Extent *extent) {
    near_bricks around = {PLACE_X(place), PLACE_Y(place), PLACE_Z(place)};
    int next = 0;
    // Of a slab they are rows of one whole.
    for (int z = around.z - 1; SOURCE != SOURCE_SLAB && z <= around.z + 1; ++z) {
        for (int y = around.y - 1; y <= around.y + 1; ++y) {
            for (int x = around.x - 1; x <= around.x + 1; ++x) {
                const bool there = x >= 0 && x < extent->bricks[0] && y >= 0 && y < extent->bricks[1] && z >= 0 &&
                                   z < extent->bricks[2];
                const size_t place_in_table = ((size_t)z * extent->bricks[1] + y) * extent->bricks[0] + x;
                around.near[next++] = there ? numbers[place_in_table] : ALL_OUTSIDE;
            }
        }
    }
    return around;
}

#if SOURCE == SOURCE_BITS
// The voxels around a brick: whole octants, so far that normals find theirs.
#define OCTANTS_BEFORE (RADIUS <= 2 ? 1 : 2)
#define OCTANTS (2 + 2 * OCTANTS_BEFORE)
#define VOXELS_BEFORE (4 * OCTANTS_BEFORE)
#define SPAN (4 * OCTANTS)
// Voxel x of the row is bit x + VOXELS_BEFORE.
typedef uint row;
typedef struct {
    uint rows[SPAN * SPAN];  // y fastest
} neighbourhood;

// An octant's bits: the two least bytes are the layer z = 0 of it, the least four bits its row y = 0.
INLINE uint2 octant_bits(__global const SAMPLE *samples, int number, int octant) {
    if (number < 0) return (uint2)(number == ALL_INSIDE ? 0xffffffffu : 0u);
    return as_uint2(vload8(0, samples + (size_t)number * 64 + 8 * octant));
}

INLINE void load_neighbourhood(neighbourhood *n, __global const SAMPLE *samples, const near_bricks *around,
                               __constant const struct Extent *extent) {
    for (int z = 0; z < OCTANTS; ++z) {
        for (int y = 0; y < OCTANTS; ++y) {
            uint8 low = (uint8)(0), high = (uint8)(0);
            for (int x = 0; x < OCTANTS; ++x) {
                // Places of octants from the brick's first; an even number of bricks before makes shifts round down.
                const int at_x = x - OCTANTS_BEFORE + 2, at_y = y - OCTANTS_BEFORE + 2, at_z = z - OCTANTS_BEFORE + 2;
                const int brick = (at_x >> 1) + 3 * (at_y >> 1) + 9 * (at_z >> 1);
                const uint2 bits = octant_bits(samples, around->near[brick], (at_x & 1) | (at_y & 1) << 1 | (at_z & 1) << 2);
                const uint8 rows = (uint8)(0, 4, 8, 12, 16, 20, 24, 28);
                low |= (((uint8)(bits.s0) >> rows) & 15u) << (uint)(4 * x);
                high |= (((uint8)(bits.s1) >> rows) & 15u) << (uint)(4 * x);
            }
            uint *first = n->rows + 4 * z * SPAN + 4 * y;
            vstore4(low.lo, 0, first);
            vstore4(low.hi, 0, first + SPAN);
            vstore4(high.lo, 0, first + 2 * SPAN);
            vstore4(high.hi, 0, first + 3 * SPAN);
        }
    }
    // Past the grid's ends the last voxel repeats.
    const uint before = (1u << VOXELS_BEFORE) - 1u, own = 0xffu << VOXELS_BEFORE;
    if (around->x == 0 || around->x == extent->bricks[0] - 1) {
        for (int i = 0; i < SPAN * SPAN; ++i) {
            uint r = n->rows[i];
            if (around->x == 0) r = (r & ~before) | ((r >> VOXELS_BEFORE & 1u) != 0 ? before : 0u);
            if (around->x == extent->bricks[0] - 1) {
                r = (r & (before | own)) | ((r >> (VOXELS_BEFORE + 7) & 1u) != 0 ? ~(before | own) : 0u);
            }
            n->rows[i] = r;
        }
    }
    const bool ends_y = around->y == 0 || around->y == extent->bricks[1] - 1;
    const bool ends_z = around->z == 0 || around->z == extent->bricks[2] - 1;
    if (ends_y || ends_z) {
        const int first_y = around->y == 0 ? VOXELS_BEFORE : 0, first_z = around->z == 0 ? VOXELS_BEFORE : 0;
        const int last_y = around->y == extent->bricks[1] - 1 ? VOXELS_BEFORE + 7 : SPAN - 1;
        const int last_z = around->z == extent->bricks[2] - 1 ? VOXELS_BEFORE + 7 : SPAN - 1;
        // Within the grid's rows nothing is overwritten before it is read.
        for (int i = 0; i < SPAN * SPAN; ++i) {
            n->rows[i] = n->rows[clamp(i / SPAN, first_z, last_z) * SPAN + clamp(i % SPAN, first_y, last_y)];
        }
    }
}
INLINE row row_at(const neighbourhood *n, int y, int z) { return n->rows[(z + VOXELS_BEFORE) * SPAN + y + VOXELS_BEFORE]; }

// Voxels `offset` to `offset` + 15 of the row; those past the neighbourhood are 0.
INLINE float16 row_window(const row *r, int offset) {
    const uint16 shift = (uint16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15) + (uint)(offset + VOXELS_BEFORE);
    return CONVERT(float16, CONVERT(int16, ((uint16)(*r) >> shift) & 1u));
}
#else
// Voxel x of the row is entry x + VOXELS_BEFORE.
#if RADIUS <= 2
#define VOXELS_BEFORE 4
typedef float16 row;
#else
#define VOXELS_BEFORE 8
typedef struct {
    float value[40];
} row;
#endif

#if SOURCE == SOURCE_BRICKS
// The row `y`, `z` (voxels from the brick's first, -8 to 15): the first of its three bricks in `near`, and the first of the
// row's voxels in them (bricks are kept octant by octant: see voxels.h; its second four are an octant further on).
INLINE int row_of(const near_bricks *around, int y, int z, __constant const struct Extent *extent, int *first) {
    const int row_y = clamp(BRICK * around->y + y, 0, BRICK * extent->bricks[1] - 1);
    const int row_z = clamp(BRICK * around->z + z, 0, BRICK * extent->bricks[2] - 1);
    const int brick_y = (row_y >> 3) - around->y + 1, brick_z = (row_z >> 3) - around->z + 1;
    *first = 9 * brick_z + 3 * brick_y;
    const int octant = ((row_z >> 1) & 2) | ((row_y >> 2) & 1);
    return OCTANT_VOXELS * 2 * octant + 16 * (row_z & 3) + 4 * (row_y & 3);
}
// Four voxels of a brick, or of none.
INLINE float4 four_voxels(__global const SAMPLE *samples, int number, int place, __constant const struct Extent *extent) {
    if (number < 0) return (float4)(number == ALL_INSIDE ? extent->whole : 0.0f);
    return CONVERT(float4, vload4(0, samples + (size_t)number * 512 + place));
}

INLINE row row_at(const neighbourhood *n, int y, int z) {
    int first;
    const near_bricks *around = n->around;
    const int place = row_of(around, y, z, n->extent, &first), next = place + OCTANT_VOXELS;
    const float4 own = four_voxels(n->samples, around->near[first + 1], place, n->extent);
    const float4 own_next = four_voxels(n->samples, around->near[first + 1], next, n->extent);
    float4 left = four_voxels(n->samples, around->near[first], next, n->extent);
    float4 right = four_voxels(n->samples, around->near[first + 2], place, n->extent);
    if (around->x == 0) left = (float4)(own.x);
    if (around->x == n->extent->bricks[0] - 1) right = (float4)(own_next.w);
#if RADIUS <= 2
    return (float16)(left, own, own_next, right);
#else
    row r;
    float4 far_left = four_voxels(n->samples, around->near[first], place, n->extent);
    float4 far_right = four_voxels(n->samples, around->near[first + 2], next, n->extent);
    if (around->x == 0) far_left = left;
    if (around->x == n->extent->bricks[0] - 1) far_right = right;
    vstore16((float16)(far_left, left, own, own_next), 0, r.value);
    vstore16((float16)(right, far_right, (float8)(0.0f)), 1, r.value);
    vstore8((float8)(0.0f), 4, r.value);
    return r;
#endif
}
#else
// The slab is some layers of a whole grid, x fastest; `first_layer` is the grid's layer that it begins with.
INLINE row row_at(const neighbourhood *n, int y, int z) {
    __constant const struct Extent *extent = n->extent;
    const int row_y = clamp(BRICK * n->around->y + y, 0, extent->last[1]);
    const int row_z = clamp(BRICK * n->around->z + z, 0, extent->last[2]) - extent->first_layer;
    const size_t start = ((size_t)row_z * (extent->last[1] + 1) + row_y) * (extent->last[0] + 1);
    const int first = BRICK * n->around->x - VOXELS_BEFORE;
#if RADIUS <= 2
    if (first >= 0 && first + 15 <= extent->last[0]) return CONVERT(float16, vload16(0, n->samples + start + first));
#endif
    float each[40];
    for (int i = 0; i < 40; ++i) {
        each[i] = i < 24 ? (float)n->samples[start + clamp(first + i, 0, extent->last[0])] : 0.0f;
    }
    row r;
#if RADIUS <= 2
    r = vload16(0, each);
#else
    for (int i = 0; i < 40; ++i) r.value[i] = each[i];
#endif
    return r;
}
#endif

// Voxels `offset` to `offset` + 8 of the row; what follows has no meaning.
INLINE float16 row_window(const row *r, int offset) {
#if RADIUS <= 2
    switch (offset) {
        case -3: return (float16)(r->s12345678, r->s9abcdeff);
        case -2: return (float16)(r->s23456789, r->sabcdefff);
        case -1: return (float16)(r->s3456789a, r->sbcdeffff);
        case 1: return (float16)(r->s56789abc, r->sdeffffff);
        case 2: return (float16)(r->s6789abcd, r->sefffffff);
        case 3: return (float16)(r->s789abcde, r->sffffffff);
        default: return (float16)(r->s456789ab, r->scdefffff);
    }
#else
    return vload16(0, r->value + offset + VOXELS_BEFORE);
#endif
}
#endif
#endif
