// A grid of voxels in bricks: 8 x 8 x 8 cells between the middles of voxels, 9 x 9 x 9 samples, so that what lies in a cell is
// found in one brick. `table` has for each brick the slot where it is stored, or, if nothing in it is visible, -(1 + sides).
// `sides` has three digits, 8 bits apart, for each octant of directions: in it, a cube of 1 << digits bricks a side that
// begins with this brick is empty.
// `blocks` has for stored bricks the blocks of 2 x 2 x 2 cells that may be visible.
#define BRICK_CELLS 8
#define BRICK_SIDE 9
#define BRICK_STRIDE 736   // samples from one brick to the next

#include "gather.h"

typedef struct {
    __constant const struct Grid *about;
    __global const int *table;
    __global const int *blocks;   // of each stored brick two words, for its lower and upper half
    __global const sample *values[4];
    __global const uchar *normals[4];
} grid;

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
    cell c;
    c.x = min(to_ints(x), (ints)(max(about->sides[0] - 2, 0)));
    c.y = min(to_ints(y), (ints)(max(about->sides[1] - 2, 0)));
    c.z = min(to_ints(z), (ints)(max(about->sides[2] - 2, 0)));
    c.u = x - to_reals(c.x);
    c.v = y - to_reals(c.y);
    c.w = z - to_reals(c.z);
    return c;
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

INLINE real between(real a, real b, real share) { return a + (b - a) * share; }

INLINE void value_pair(__global const sample *values, ints index, real *first, real *second) {
#if VALUE_IS_FLOAT
    *first = gather_floats(values, index);
    *second = gather_floats(values, index + 1);
#else
    gather_pair(values, index, first, second);
#endif
}

// The value in one buffer of stored bricks, as it is kept (0 to 255 in 8 bits).
INLINE real pool_value(__global const sample *values, cell c, ints at) {
    real a, b, d, e;
    value_pair(values, at, &a, &b);
    value_pair(values, at + BRICK_SIDE, &d, &e);
#if NEAREST
    const mask right = less_equal(R(0.5), c.u), up = less_equal(R(0.5), c.v), deep = less_equal(R(0.5), c.w);
    const real low = pick(up, pick(right, e, d), pick(right, b, a));
#else
    const real low = between(between(a, b, c.u), between(d, e, c.u), c.v);
#endif
    value_pair(values, at + BRICK_SIDE * BRICK_SIDE, &a, &b);
    value_pair(values, at + BRICK_SIDE * BRICK_SIDE + BRICK_SIDE, &d, &e);
#if NEAREST
    return pick(deep, pick(up, pick(right, e, d), pick(right, b, a)), low);
#else
    return between(low, between(between(a, b, c.u), between(d, e, c.u), c.v), c.w);
#endif
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

// The value at a place of stored bricks.
INLINE real grid_value(cell c, ints slots, mask active, grid g) {
    const ints corner = corner_of(c);
#if POOLS == 1
    return pool_value(g.values[0], c, pick_ints(active, slots, 0) * BRICK_STRIDE + corner);
#else
    real value = R(0.0);
    #pragma unroll
    for (int pool = 0; pool < TURNS(POOLS); ++pool) {
        const ints place = slots - pool * g.about->pool_bricks;
        const mask here = active & less(R(-0.5), to_reals(place)) & less(to_reals(place), (real)((scalar)g.about->pool_bricks));
        if (!any_lane(here)) continue;
        value = pick(here, pool_value(g.values[pool], c, pick_ints(here, place, 0) * BRICK_STRIDE + corner), value);
    }
    return value;
#endif
}

// The normal at a place of stored bricks, length 1, or 0 where there is none: blended from those of the cell's corners.
INLINE vec grid_normal(cell c, ints slots, mask active, grid g) {
    const ints corner = corner_of(c);
#if POOLS == 1
    return vec_normalize(pool_normal(g.normals[0], c, pick_ints(active, slots, 0) * BRICK_STRIDE + corner));
#else
    vec normal = vec_of(R(0.0), R(0.0), R(0.0));
    #pragma unroll
    for (int pool = 0; pool < TURNS(POOLS); ++pool) {
        const ints place = slots - pool * g.about->pool_bricks;
        const mask here = active & less(R(-0.5), to_reals(place)) & less(to_reals(place), (real)((scalar)g.about->pool_bricks));
        if (!any_lane(here)) continue;
        normal = vec_pick(here, pool_normal(g.normals[pool], c, pick_ints(here, place, 0) * BRICK_STRIDE + corner), normal);
    }
    return vec_normalize(normal);
#endif
}
