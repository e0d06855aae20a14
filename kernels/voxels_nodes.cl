// Which nodes of the octree hold nothing of the solid, by the distance from their middles. One work-item takes LANES nodes.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "voxels.h"

#define OCTANT 4  // its voxels a side

// Middle of a node's first and last voxel along an axis, and half their distance. An octant of a brick ends before its
// neighbour's first voxel; larger nodes share that one.
INLINE void middle_of(__global const scalar *along, int cells, int node, int last, scalar *middle, scalar *half_side) {
    const int low = min(cells * node, last), high = min(low + (cells == OCTANT ? cells - 1 : cells), last);
    *middle = S(0.5) * (along[low] + along[high]);
    *half_side = S(0.5) * (along[high] - along[low]);
}

// A node whose image, of radius r, comes near 0 in z: there a map of a degree above 1 has hardly any slope, as its middle
// tells, but it has elsewhere in the node, and the distance would be too large.
INLINE mask doubtful(real square, real radius_square) {
#if LOGARITHMIC
    return less(R(0.25) * square, radius_square) & less(square, R(4.0));
#else
    return less(R(1.0), R(0.0));
#endif
}

#if HAS_SHAPE
INLINE real node_distance(vec point, real reach, __constant const struct Orbit *orbit, __constant const scalar *k) {
    return orbit_distance(point, equal(R(0.0), R(0.0)), orbit, k).step;
}
#else

#if STATE_SIZE == 4
#define STATE_DOT(a, b) (z.s0.a * z.s0.b + z.s1.a * z.s1.b + z.s2.a * z.s2.b + z.s3.a * z.s3.b)
#else
#define STATE_DOT(a, b) (z.s0.a * z.s0.b + z.s1.a * z.s1.b + z.s2.a * z.s2.b)
#endif

// The distance as `orbit_distance` finds it, but the growth is that in any direction. The growth of |z| alone may vanish by
// chance: a ray that steps too far is told so by its next step, a node by nothing.
INLINE real node_distance(vec point, real reach, __constant const struct Orbit *orbit, __constant const scalar *k) {
#if HAS_DERIVATIVE
    state c, z;
    start(point, k, &c, &z);
    real growth = R(1.0), square = state_square(z);
#else
    dual_state c, z;
    dual_start(point, k, &c, &z);
    real square = dual_state_square(z);
#endif
    real count = (real)((scalar)FIRST_COUNT);
    mask alive = less_equal(square, (real)(orbit->distance_square));
    mask near = alive & ~alive;
    for (int n = FIRST_COUNT; n < orbit->longest; ++n) {
        if (n == orbit->iterations) near |= alive & settled(square, orbit);
#if HAS_DERIVATIVE
        near |= alive & doubtful(square, (reach * growth) * (reach * growth));
#else
        near |= alive & doubtful(square, reach * reach * (STATE_DOT(dx, dx) + STATE_DOT(dy, dy) + STATE_DOT(dz, dz)));
#endif
        alive &= ~near;
        if (!any_lane(alive)) break;
#if HAS_DERIVATIVE
        real next_growth = growth;
        const state next = apply_derivative(n, z, c, &next_growth, k);
        z = state_pick(alive, next, z);
        growth = pick(alive, next_growth, growth);
        square = pick(alive, state_square(next), square);
#else
        const dual_state next = dual_apply(n, z, c, k);
        z = dual_state_pick(alive, next, z);
        square = pick(alive, dual_state_square(next), square);
#endif
        count = pick(alive, (real)((scalar)(n + 1)), count);
        alive &= less_equal(square, (real)(orbit->distance_square));
    }
    if (orbit->longest <= orbit->iterations) near |= alive & settled(square, orbit);
#if !HAS_DERIVATIVE
    // The root of the largest sum of a row of |J^T J| is no less than J's largest singular value, and equal to it where the
    // map is conformal.
    const real xx = STATE_DOT(dx, dx), yy = STATE_DOT(dy, dy), zz = STATE_DOT(dz, dz);
    const real xy = fabs(STATE_DOT(dx, dy)), yz = fabs(STATE_DOT(dy, dz)), zx = fabs(STATE_DOT(dz, dx));
    const real growth = sqrt(fmax(fmax(xx + xy + zx, yy + xy + yz), zz + yz + zx));
#endif
    const real distance = distance_from_growth(square, sqrt(square) / growth, count, orbit);
    return pick(near, R(0.0), distance);
}
#endif

// A node is empty if the ball around its middle that the distance proves to be outside holds all its points. `nodes` are
// places of nodes of `cells` voxels a side; for octants they are those of bricks, each of which stands for its eight.
__kernel void empty_nodes(__global uchar *empty, __global const ulong *nodes, int first, int count,
                          int cells, __global const scalar *axes, __constant const struct Lattice *lattice,
                          __constant const struct Orbit *orbit, __constant const scalar *k) {
    const size_t item = (size_t)first + get_global_id(1);
    if (item >= count) return;
    // Of a voxel's sub-points the middle lies in the middle: the mean of the first and the last.
    __global const scalar *along_y = axes + lattice->sub_points * lattice->padded[0];
    __global const scalar *along_z = along_y + lattice->sub_points * lattice->padded[1];
    const int last_sub = lattice->sub_points - 1;
    scalar x[LANES], y[LANES], z[LANES], reach[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const size_t node = item * LANES + lane;
        int at_x, at_y, at_z;
        if (cells == OCTANT) {
            const ulong brick = nodes[node >> 3];
            at_x = 2 * PLACE_X(brick) + (int)(node & 1);
            at_y = 2 * PLACE_Y(brick) + (int)((node >> 1) & 1);
            at_z = 2 * PLACE_Z(brick) + (int)((node >> 2) & 1);
        } else {
            at_x = PLACE_X(nodes[node]);
            at_y = PLACE_Y(nodes[node]);
            at_z = PLACE_Z(nodes[node]);
        }
        scalar side_x, side_y, side_z, other, ignored;
        middle_of(axes, cells, at_x, lattice->last[0], x + lane, &side_x);
        middle_of(along_y, cells, at_y, lattice->last[1], y + lane, &side_y);
        middle_of(along_z, cells, at_z, lattice->last[2], z + lane, &side_z);
        if (last_sub > 0) {
            middle_of(axes + last_sub * lattice->padded[0], cells, at_x, lattice->last[0], &other, &ignored);
            x[lane] = S(0.5) * (x[lane] + other);
            middle_of(along_y + last_sub * lattice->padded[1], cells, at_y, lattice->last[1], &other, &ignored);
            y[lane] = S(0.5) * (y[lane] + other);
            middle_of(along_z + last_sub * lattice->padded[2], cells, at_z, lattice->last[2], &other, &ignored);
            z[lane] = S(0.5) * (z[lane] + other);
        }
        side_x += lattice->margin[0];
        side_y += lattice->margin[1];
        side_z += lattice->margin[2];
        reach[lane] = sqrt(side_x * side_x + side_y * side_y + side_z * side_z);
    }
    const vec middle = vec_of(lanes_load(x), lanes_load(y), lanes_load(z));
    const real safe = node_distance(middle, lanes_load(reach), orbit, k) * (real)(lattice->step_scale);
    lanes_store(pick(less(lanes_load(reach), safe), R(1.0), R(0.0)), x);
    for (int lane = 0; lane < LANES; ++lane) empty[item * LANES + lane] = x[lane] != 0;
}
