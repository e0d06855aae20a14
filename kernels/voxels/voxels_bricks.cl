// The stored part of a grid: bricks of 9 x 9 x 9 samples with their normals. One work-item takes one brick, or a part of it (ALONE).
//
// From the build besides what voxels_bricks.h needs: RADIUS of the low-pass filter before normals, voxels.
#include "structs.h"
#include "voxels/voxels_bricks.h"

// Weights of the binomial low-pass filter of each RADIUS, and of the central difference after it, for voxels 1, 2, ... away (the
// other side has the same, and the same negated): as differences of equal values they give exactly 0.
__constant float SMOOTH[5][5] = {{1.0f}, {2.0f, 1.0f}, {6.0f, 4.0f, 1.0f}, {20.0f, 15.0f, 6.0f, 1.0f}, {70.0f, 56.0f, 28.0f, 8.0f, 1.0f}};
__constant float DIFFER[5][5] = {{1.0f}, {2.0f, 1.0f}, {5.0f, 4.0f, 1.0f}, {14.0f, 14.0f, 6.0f, 1.0f}, {42.0f, 48.0f, 27.0f, 8.0f, 1.0f}};
#define REACH (RADIUS + 1)  // voxels that a normal depends on, to each side
#define LAYERS (BRICK_SIDE + 2 * REACH)
// Where a layer or a line is kept while others need it. One that is alone keeps them in registers, which have no places that are
// found at run time: the newest is the last, and the others move.
#if ALONE
#define SLOTS (2 * REACH + 1)
#define SLOT(number) (2 * REACH)
#define MIDDLE_SLOT(z) REACH
#define MOVE_ON(array) \
    for (int place = 0; place < 2 * REACH; ++place) array[place] = array[place + 1]
#else
#define SLOTS LAYERS
#define SLOT(number) (number)
#define MIDDLE_SLOT(z) ((z) + REACH)
#define MOVE_ON(array)
#endif

// The filter's mean of numbers `step` apart around the one in the middle, and its difference of those after and before.
INLINE wide smoothed(const wide *middle, int step) {
    wide sum = SMOOTH[RADIUS][0] * middle[0];
    #pragma unroll
    for (int i = 1; i <= RADIUS; ++i) sum += SMOOTH[RADIUS][i] * (middle[-i * step] + middle[i * step]);
    return sum;
}
INLINE wide differed(const wide *middle, int step) {
    wide sum = (wide)(0.0f);
    #pragma unroll
    for (int i = 1; i <= REACH; ++i) sum += DIFFER[RADIUS][i - 1] * (middle[i * step] - middle[-i * step]);
    return sum;
}

// 1/sqrt of each; a vector of 16 is more than some compilers can take the root of.
INLINE wide reciprocal_root(wide a) {
#if ALONE
    return 1.0f / sqrt(a);
#else
    float16 result = (float16)(0.0f);
    result.lo = 1.0f / sqrt(a.lo);
    result.s8 = 1.0f / sqrt(a.s8);
    return result;
#endif
}

// A component of a normal as the 8 bits of a colour.
INLINE wide_uint color_of(wide component) { return WHOLE(component * 127.5f + 128.0f); }

// Eq. 6 of Englund 2010 after the filter: n = -G/|G| with G the central differences, (n + 1)/2 in red, green and blue, `alpha`
// above. (The thesis prints f(x - 1) - f(x - 1).) Where G is 0 there is no normal, 128 in each.
INLINE wide_uint packed_normal(wide gx, wide gy, wide gz, wide_uint alpha) {
    const wide largest = fmax(fmax(fabs(gx), fabs(gy)), fabs(gz));
    const wide_int usable = (largest > 0.0f) & (largest <= 3.0e38f);
    const wide none = (wide)(0.0f), scale = usable ? -1.0f / largest : none;
    gx = usable ? gx * scale : none;
    gy = usable ? gy * scale : none;
    gz = usable ? gz * scale : none;
    const wide square = gx * gx + gy * gy + gz * gz;  // 1 to 3, or 0
    const wide unit = reciprocal_root(fmax(square, (wide)(0.5f)));
    return color_of(gx * unit) | color_of(gy * unit) << 8 | color_of(gz * unit) << 16 | alpha << 24;
}

// A row's nine values, or the own one, from number `at` of floats or bytes on.
INLINE void store_values(__global uchar *values, size_t at, int floats, wide row) {
    __global float *to_floats = (__global float *)values + at;
    __global uchar *to_bytes = values + at;
#if ALONE
    if (floats) {
        *to_floats = row;
    } else {
        *to_bytes = convert_uchar(row);
    }
#else
    if (floats) {
        vstore8(row.lo, 0, to_floats);
        to_floats[8] = row.s8;
    } else {
        vstore8(CONVERT(uchar8, row.lo), 0, to_bytes);
        to_bytes[8] = convert_uchar(row.s8);
    }
#endif
}

// Where a brick's samples are stored, and which of its lines and columns this item stores.
typedef struct {
    __global uchar *values;
    __global uint *normal;
    size_t start;   // of the brick's values
    int first_line, own;
} brick_place;

INLINE void store_normal(__global uint *out, wide_uint packed) {
#if ALONE
    *out = packed;
#else
    vstore8(packed.lo, 0, out);
    out[8] = packed.s8;
#endif
}

INLINE void store_samples(neighbourhood *n, brick_place at, __constant const struct Extent *extent) {
    // Filtered along x and y: the values, and their differences along x and along y; of each slot LINES lines.
    wide plain[SLOTS * LINES], along_x[SLOTS * LINES], along_y[SLOTS * LINES];
    wide_uint alpha[SLOTS * LINES];
    for (int layer = 0; layer < LAYERS; ++layer) {
        wide rows[SLOTS], rows_x[SLOTS];
        const int z = layer - REACH, kept = SLOT(layer) * LINES;
        MOVE_ON(plain);
        MOVE_ON(along_x);
        MOVE_ON(along_y);
        MOVE_ON(alpha);
        for (int line = 0; line < LINES + 2 * REACH; ++line) {
            const int y = line - REACH;
            const row r = row_at(n, at.first_line + y, z);
            wide window[2 * REACH + 1];
            #pragma unroll
            for (int i = -REACH; i <= REACH; ++i) window[i + REACH] = row_window(&r, i);
            const wide middle = window[REACH];
            MOVE_ON(rows);
            MOVE_ON(rows_x);
            rows[SLOT(line)] = smoothed(window + REACH, 1);
            rows_x[SLOT(line)] = differed(window + REACH, 1);
            if (z >= 0 && z < BRICK_SIDE && y >= 0 && y < LINES) {
                alpha[kept + (ALONE ? 0 : y)] = middle >= extent->opaque ? (wide_uint)(255u) : (wide_uint)(0u);
                store_values(at.values, at.start + BRICK_SIDE * (BRICK_SIDE * z + at.first_line + y) + at.own, extent->floats,
                             middle * extent->scale);
            }
        }
        for (int y = 0; y < LINES; ++y) {
            const int line = y + REACH;
            plain[kept + y] = smoothed(rows + line, 1);
            along_x[kept + y] = smoothed(rows_x + line, 1);
            along_y[kept + y] = differed(rows + line, 1);
        }
        // The layer that has all its neighbours now.
        const int done = z - REACH;
        for (int y = 0; done >= 0 && y < LINES; ++y) {
            const int middle = MIDDLE_SLOT(done) * LINES + y;
            const wide gx = smoothed(along_x + middle, LINES), gy = smoothed(along_y + middle, LINES);
            const wide gz = differed(plain + middle, LINES);
            // In the scene, to which the inverse transposed of the grid's steps brings a gradient.
            const wide nx = gx * extent->normal_x[0] + gy * extent->normal_y[0] + gz * extent->normal_z[0];
            const wide ny = gx * extent->normal_x[1] + gy * extent->normal_y[1] + gz * extent->normal_z[1];
            const wide nz = gx * extent->normal_x[2] + gy * extent->normal_y[2] + gz * extent->normal_z[2];
            const wide_uint packed = packed_normal(nx, ny, nz, alpha[middle]);
            store_normal(at.normal + BRICK_SIDE * (BRICK_SIDE * done + at.first_line + y) + at.own, packed);
        }
    }
}

// Values and normals of the bricks from `first` on, into slots from `slot` on.
__kernel void store_bricks(__global uchar *values, __global uint *normals, __global const ulong *bricks, int first, int count,
                           int slot, __global const SAMPLE *samples, __global const int *numbers,
                           __constant const struct Extent *extent) {
    const int brick = first + (int)get_global_id(1);
    if (brick >= count) return;
    const near_bricks around = near_bricks_of(bricks[brick], numbers, extent);
    neighbourhood n;
    load_neighbourhood(&n, samples, &around, extent);
    int own = 0, first_line = 0;
#if ALONE
    // The rest of the items fills the last group.
    const int item = (int)get_global_id(0);
    if (item >= BRICK_SIDE * BRICK_SIDE) return;
    n.own = own = item % BRICK_SIDE;
    first_line = item / BRICK_SIDE;
#endif
    const size_t start = (size_t)(slot + brick) * BRICK_STRIDE;
    const brick_place at = {values, normals + start, start, first_line, own};
    store_samples(&n, at, extent);
    for (int i = BRICK_SAMPLES; i < BRICK_STRIDE && own + first_line == 0; ++i) {
        if (extent->floats) {
            ((__global float *)values)[start + i] = 0.0f;
        } else {
            values[start + i] = 0;
        }
        at.normal[i] = 0x00808080u;
    }
}
