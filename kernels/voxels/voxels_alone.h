// What a work-item has of rows of voxels. On a processor it takes a brick, nine voxels of a row in a vector. On a GPU, where that
// would fill 30 KB of private memory, it takes one x and one y of a brick (ALONE), and looks up voxel by voxel.
#if ALONE
typedef float wide;
typedef int wide_int;
typedef uint wide_uint;
#define LINES 1   // of a brick, in y, that a work-item takes
#define WHOLE(a) ((uint)convert_int(a))
#else
typedef float16 wide;
typedef int16 wide_int;
typedef uint16 wide_uint;
#define LINES BRICK_SIDE
#define WHOLE(a) as_uint16(CONVERT(int16, a))
#endif

// The place of a brick, and where its voxels are.
typedef struct {
    int x, y, z;
#if ALONE
    __global const int *numbers;
#else
    int near[27];  // the evaluated bricks around it, x fastest; or ALL_OUTSIDE, ALL_INSIDE
#endif
} near_bricks;

#if ALONE || SOURCE != SOURCE_BITS
// The voxels around a brick, or around the `own` x of it of a work-item that is alone: rows are loaded one by one.
typedef struct {
    __global const SAMPLE *samples;
    const near_bricks *around;
    __constant const struct Extent *extent;
    int own;
} neighbourhood;

INLINE void load_neighbourhood(neighbourhood *n, __global const SAMPLE *samples, const near_bricks *around,
                               __constant const struct Extent *extent) {
    n->samples = samples;
    n->around = around;
    n->extent = extent;
}
#endif

#if ALONE
INLINE near_bricks near_bricks_of(ulong place, __global const int *numbers, __constant const struct Extent *extent) {
    return (near_bricks){PLACE_X(place), PLACE_Y(place), PLACE_Z(place), numbers};
}

typedef struct {
    const neighbourhood *n;
    int y, z;
} row;

INLINE row row_at(const neighbourhood *n, int y, int z) { return (row){n, y, z}; }

// The voxel `offset` from the own one.
INLINE float row_window(const row *r, int offset) {
    const neighbourhood *n = r->n;
    __constant const struct Extent *extent = n->extent;
    const int x = BRICK * n->around->x + n->own + offset, y = BRICK * n->around->y + r->y, z = BRICK * n->around->z + r->z;
#if SOURCE == SOURCE_SLAB
    const size_t line = (size_t)(clamp(z, 0, extent->last[2]) - extent->first_layer) * (extent->last[1] + 1) +
                        clamp(y, 0, extent->last[1]);
    return (float)n->samples[line * (extent->last[0] + 1) + clamp(x, 0, extent->last[0])];
#else
    const int at_x = clamp(x, 0, BRICK * extent->bricks[0] - 1), at_y = clamp(y, 0, BRICK * extent->bricks[1] - 1);
    const int at_z = clamp(z, 0, BRICK * extent->bricks[2] - 1);
    const size_t brick = ((size_t)(at_z >> 3) * extent->bricks[1] + (at_y >> 3)) * extent->bricks[0] + (at_x >> 3);
    const int number = n->around->numbers[brick];
    const int octant = (at_z & 4) | (at_y & 4) >> 1 | (at_x & 4) >> 2;
#if SOURCE == SOURCE_BITS
    if (number < 0) return number == ALL_INSIDE ? 1.0f : 0.0f;
    const uint two_rows = n->samples[(size_t)number * 64 + 8 * octant + 2 * (at_z & 3) + ((at_y & 2) >> 1)];
    return (float)((two_rows >> (4 * (at_y & 1) + (at_x & 3))) & 1u);
#else
    if (number < 0) return number == ALL_INSIDE ? extent->whole : 0.0f;
    return (float)n->samples[(size_t)number * 512 + OCTANT_VOXELS * octant + 16 * (at_z & 3) + 4 * (at_y & 3) + (at_x & 3)];
#endif
#endif
}
#endif
