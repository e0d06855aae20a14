// A grid of voxels in bricks: 8 x 8 x 8 cells between the middles of voxels, 9 x 9 x 9 samples, so that what lies in a cell is
// found in one brick. `table` has for each brick the slot where it is stored, or, if nothing in it is visible, -(1 + sides).
// `sides` has three digits, 8 bits apart, for each octant of directions: in it, a cube of 1 << digits bricks a side that
// begins with this brick is empty.
// `blocks` has for stored bricks the blocks of 2 x 2 x 2 cells that may be visible.
#include "voxels/bricks.h"
#include "device/gather.h"

typedef struct {
    __constant const struct Grid *about;
    __global const int *table;
    __global const int *blocks;   // of each stored brick two words, for its lower and upper half
    __global const uchar *values[4];   // bytes, or floats (`floats` in `about`)
    __global const uchar *normals[4];
} grid;

// One of four buffers. (In an array of pointers a number that is not known before would be a place in memory.)
#define POOL(buffers, pool) ((pool) == 0 ? buffers[0] : (pool) == 1 ? buffers[1] : (pool) == 2 ? buffers[2] : buffers[3])

// A place among the cells: which one, and where in it, 0 to 1.
typedef struct {
    ints x, y, z;
    real u, v, w;
} cell;

// The cell that holds a point, given in voxels from the middle of the first; beyond the outermost middles the nearest goes on.
// (NaN, in lanes without a ray, belongs to the last cell, so that nothing is read past the grid.)
INLINE cell cell_at(vec p, __constant const struct Grid *about) {
    const real x = least(most(p.x, R(0.0)), (real)((scalar)(about->sides[0] - 1)));
    const real y = least(most(p.y, R(0.0)), (real)((scalar)(about->sides[1] - 1)));
    const real z = least(most(p.z, R(0.0)), (real)((scalar)(about->sides[2] - 1)));
    const ints i = min(to_ints(x), (ints)(max(about->sides[0] - 2, 0))), j = min(to_ints(y), (ints)(max(about->sides[1] - 2, 0)));
    const ints k = min(to_ints(z), (ints)(max(about->sides[2] - 2, 0)));
    return (cell){i, j, k, x - to_reals(i), y - to_reals(j), z - to_reals(k)};
}

// The table's entry for a cell's brick.
INLINE ints brick_at(cell c, grid g) {
    const int row = g.about->bricks[0], layer = row * g.about->bricks[1];
    return gather_ints(g.table, (c.z >> 3) * layer + ((c.y >> 3) * row + (c.x >> 3)));
}

// Lanes whose brick is stored.
INLINE mask is_stored(ints entry) { return ~(entry >> 31); }

// The blocks around a cell of a stored brick: its octant's, eight bits, x fastest, and the bit of its own.
INLINE ints octant_at(cell c, ints entry, mask stored, grid g, mask *seen) {
    const ints word = gather_ints(g.blocks, 2 * (entry & stored) + ((c.z >> 2) & 1));
    const ints octant = (word >> (((c.y & 4) << 2) + ((c.x & 4) << 1))) & 255;
    *seen = stored & -((octant >> (((c.z & 2) << 1) + (c.y & 2) + ((c.x & 2) >> 1))) & 1);
    return octant;
}

// Where a cell's first corner lies in its stored brick.
INLINE ints corner_of(cell c) { return ((c.z & 7) * BRICK_SIDE + (c.y & 7)) * BRICK_SIDE + (c.x & 7); }

// The values at the corners of a cell in one buffer of stored bricks, x fastest, as they are kept (0 to 255 in 8 bits).
INLINE void corner_values(__global const uchar *values, int floats, ints at, real *corners) {
    if (floats) {
        #pragma unroll
        for (int i = 0; i < 8; ++i) {
            const int further = (i & 1) + BRICK_SIDE * ((i >> 1) & 1) + BRICK_SIDE * BRICK_SIDE * (i >> 2);
            corners[i] = gather_floats((__global const float *)values, at + further);
        }
    } else {
        #pragma unroll
        for (int i = 0; i < 8; i += 2) {
            const int further = BRICK_SIDE * ((i >> 1) & 1) + BRICK_SIDE * BRICK_SIDE * (i >> 2);
            gather_pair(values, at + further, corners + i, corners + i + 1);
        }
    }
}

INLINE real blended_value(const real *a, cell c) {
    const real low = between(between(a[0], a[1], c.u), between(a[2], a[3], c.u), c.v);
    return between(low, between(between(a[4], a[5], c.u), between(a[6], a[7], c.u), c.v), c.w);
}

INLINE real nearest_value(const real *a, cell c) {
    const mask right = less_equal(R(0.5), c.u), up = less_equal(R(0.5), c.v), deep = less_equal(R(0.5), c.w);
    const real low = pick(up, pick(right, a[3], a[2]), pick(right, a[1], a[0]));
    return pick(deep, pick(up, pick(right, a[7], a[6]), pick(right, a[5], a[4])), low);
}

// The sum of the corners' normals, each with its share of the cell.
INLINE vec pool_normal(__global const uchar *normals, cell c, ints at) {
    vec sum = vec_of(R(0.0), R(0.0), R(0.0));
    real all = R(0.0);
    #pragma unroll
    for (int i = 0; i < TURNS(8); ++i) {
        const real across = (i & 1) ? c.u : R(1.0) - c.u, up = (i & 2) ? c.v : R(1.0) - c.v, deep = (i & 4) ? c.w : R(1.0) - c.w;
        const int further = (i & 1) + BRICK_SIDE * ((i >> 1) & 1) + BRICK_SIDE * BRICK_SIDE * (i >> 2);
        const ints found = gather_ints((__global const int *)normals, at + further);
        // 128 in all three components means that there is no normal.
        const real weight = pick(equal_ints(found & 0xffffff, (ints)(0x808080)), R(0.0), across * up * deep);
        sum = vec_along(sum, weight, vec_of(to_reals(found & 255), to_reals((found >> 8) & 255), to_reals((found >> 16) & 255)));
        all += weight;
    }
    return vec_sub(sum, vec_scale(vec_of(R(1.0), R(1.0), R(1.0)), R(127.5) * all));
}

// Slots counted from the first of a buffer, and the lanes whose slot it has.
INLINE ints pool_slots(ints slots, int pool, mask *active, grid g) {
    if (g.about->pools == 1) return slots;
    const ints place = slots - pool * g.about->pool_bricks;
    *active &= less(R(-0.5), to_reals(place)) & less(to_reals(place), (real)((scalar)g.about->pool_bricks));
    return place;
}

// The value at a place of stored bricks in any of several buffers, or of the nearest voxel.
CALLED real value_of_pools(const cell *c, ints slots, mask active, grid g) {
    real value = R(0.0), corners[8];
    for (int pool = 0; pool < g.about->pools; ++pool) {
        mask here = active;
        const ints place = pool_slots(slots, pool, &here, g);
        if (!any_lane(here)) continue;
        corner_values(POOL(g.values, pool), g.about->floats, pick_ints(here, place, 0) * BRICK_STRIDE + corner_of(*c), corners);
        value = pick(here, g.about->nearest ? nearest_value(corners, *c) : blended_value(corners, *c), value);
    }
    return value;
}

// The value at a place of stored bricks.
INLINE real grid_value(cell c, ints slots, mask active, grid g) {
    if (!g.about->plain) return value_of_pools(&c, slots, active, g);
    real corners[8];
    corner_values(g.values[0], g.about->floats, pick_ints(active, slots, 0) * BRICK_STRIDE + corner_of(c), corners);
    return blended_value(corners, c);
}

// The normal at a place of stored bricks, length 1, or 0 where there is none: blended from those of the cell's corners.
INLINE vec grid_normal(cell c, ints slots, mask active, grid g) {
    const ints corner = corner_of(c);
    vec normal = vec_of(R(0.0), R(0.0), R(0.0));
    for (int pool = 0; pool < g.about->pools; ++pool) {
        mask here = active;
        const ints place = pool_slots(slots, pool, &here, g);
        if (!any_lane(here)) continue;
        normal = vec_pick(here, pool_normal(POOL(g.normals, pool), c, pick_ints(here, place, 0) * BRICK_STRIDE + corner), normal);
    }
    return vec_normalize(normal);
}
