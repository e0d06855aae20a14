// Which nodes of the octree hold nothing of the solid, by the distance from their middles, and which nothing else, by the orbits
// of their corners. One work-item takes LANES nodes.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "solids.h"
#include "voxels.h"
#include "node_proof.h"

#define OCTANT 4  // its voxels a side

// Middle of a node's first and last voxel along an axis, and half their distance. An octant of a brick ends before its
// neighbour's first voxel; larger nodes share that one.
INLINE void middle_of(__global const scalar *along, int cells, int node, int last, scalar *middle, scalar *half_side) {
    const int low = min(cells * node, last), high = min(low + (cells == OCTANT ? cells - 1 : cells), last);
    *middle = S(0.5) * (along[low] + along[high]);
    *half_side = S(0.5) * (along[high] - along[low]);
}

#define UNDECIDED 0
#define EMPTY 1
#define FULL 2

// A node is empty if the ball around its middle that the distance proves to be outside holds all its points. `nodes` are
// places of nodes of `cells` voxels a side; for octants they are those of bricks, each of which stands for its eight.
__kernel void classify_nodes(__global uchar *classes, __global const ulong *nodes, int first, int count,
                          int cells, __global const scalar *axes, __constant const struct Lattice *lattice,
                          __constant const struct Orbit *orbit, __constant const scalar *k) {
    const size_t item = (size_t)first + get_global_id(1);
    if (item >= count || orbit_cancelled(orbit)) return;
    // Of a voxel's sub-points the middle lies in the middle: the mean of the first and the last.
    __global const scalar *along_y = axes + lattice->sub_points * lattice->padded[0];
    __global const scalar *along_z = along_y + lattice->sub_points * lattice->padded[1];
    const int last_sub = lattice->sub_points - 1;
    scalar x[LANES], y[LANES], z[LANES], half_x[LANES], half_y[LANES], half_z[LANES];
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
        half_x[lane] = side_x;
        half_y[lane] = side_y;
        half_z[lane] = side_z;
    }
    const vec middle = vec_of(lanes_load(x), lanes_load(y), lanes_load(z));
    const vec half_side = vec_of(lanes_load(half_x), lanes_load(half_y), lanes_load(half_z));
    const real reach = sqrt(vec_dot(half_side, half_side));
    const mask empty = less(reach, node_distance(middle, reach, orbit, k) * (real)(lattice->step_scale));
    const mask full = node_inside(middle, half_side, ~empty, orbit, k);
    lanes_store(pick(empty, R(1.0), pick(full, R(2.0), R(0.0))), x);
    for (int lane = 0; lane < LANES; ++lane) {
        classes[item * LANES + lane] = x[lane] == 1 ? EMPTY : x[lane] == 2 ? FULL : UNDECIDED;
    }
}
