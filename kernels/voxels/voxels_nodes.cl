// Which nodes of the octree hold nothing of the solid, by the distance from their middles, and which nothing else, by the orbits
// of their corners. One work-item takes LANES nodes.
#include "voxels/voxels.h"
#include "formulas/node_proof.h"

#define OCTANT 4  // its voxels a side

// Middle of a node's first and last voxel along an axis, and half their distance. An octant of a brick ends before its
// neighbour's first voxel; larger nodes share that one.
INLINE void middle_of(__global const scalar *along, int cells, int node, int last, scalar *middle, scalar *half_side) {
    const int low = min(cells * node, last), high = min(low + (cells == OCTANT ? cells - 1 : cells), last);
    *middle = S(0.5) * (along[low] + along[high]);
    *half_side = S(0.5) * (along[high] - along[low]);
}

// 0: undecided, 1: empty, 2: full. A node is empty if the ball around its middle that the distance proves to be outside holds all its
// points. `nodes` are places of nodes of `cells` voxels a side; for octants those of bricks, each of which stands for its eight.
__kernel void classify_nodes(__global uchar *classes, __global const ulong *nodes, int first, int count,
                          int cells, __global const scalar *axes, __constant const struct Lattice *lattice,
                          orbit_record orbit, constants k) {
    const size_t item = (size_t)first + get_global_id(1);
    if (item >= count || orbit_cancelled(orbit)) return;
    // Of a voxel's sub-points the middle lies in the middle: the mean of the first and the last.
    const int last_sub = lattice->sub_points - 1;
    scalar middles[3][LANES], halves[3][LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const size_t node = item * LANES + lane;
        const ulong place = nodes[cells == OCTANT ? node >> 3 : node];
        const int at[3] = {PLACE_X(place), PLACE_Y(place), PLACE_Z(place)};
        __global const scalar *along = axes;
        for (int axis = 0; axis < 3; ++axis) {
            const int number = cells == OCTANT ? 2 * at[axis] + (int)((node >> axis) & 1) : at[axis], last = lattice->last[axis];
            scalar half_side, other, ignored;
            middle_of(along, cells, number, last, &middles[axis][lane], &half_side);
            if (last_sub > 0) {
                middle_of(along + last_sub * lattice->padded[axis], cells, number, last, &other, &ignored);
                middles[axis][lane] = S(0.5) * (middles[axis][lane] + other);
            }
            halves[axis][lane] = half_side + lattice->margin[axis];
            along += lattice->sub_points * lattice->padded[axis];
        }
    }
    const vec middle = vec_load(middles), half_side = vec_load(halves);
    const real reach = sqrt(vec_dot(half_side, half_side));
    const mask empty = less(reach, node_distance(middle, reach, orbit, k) * (real)(lattice->step_scale));
    const mask full = node_inside(middle, half_side, ~empty, orbit, k);
    scalar found[LANES];
    lanes_store(pick(empty, R(1.0), pick(full, R(2.0), R(0.0))), found);
    for (int lane = 0; lane < LANES; ++lane) classes[item * LANES + lane] = (uchar)found[lane];
}
