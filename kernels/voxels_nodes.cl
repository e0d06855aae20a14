// Which nodes of the octree hold nothing of the solid, by the distance from their middles. One work-item takes LANES nodes.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "voxels.h"

// Middle of voxels `first` to `last` along an axis, and half their distance.
INLINE void middle_of(__global const scalar *along, int cells, int node, int last, scalar *middle, scalar *half_side) {
    const int low = cells * node, high = min(low + cells, last);
    *middle = S(0.5) * (along[low] + along[high]);
    *half_side = S(0.5) * (along[high] - along[low]);
}

// A node of `cells` voxels a side, with the layer after them that it shares with the next: empty if the ball around its
// middle that the distance proves to be outside holds all its points.
__kernel void empty_nodes(__global uchar *empty, __global const ulong *nodes, int first, int count,
                          int cells, __global const scalar *axes, __constant const struct Lattice *lattice,
                          __constant const struct Orbit *orbit, __constant const scalar *k) {
    const size_t item = (size_t)first + get_global_id(1);
    if (item >= count) return;
    __global const ulong *place = nodes + item * LANES;
    // Of a voxel's sub-points the middle lies in the middle: the mean of the first and the last.
    __global const scalar *along_y = axes + lattice->sub_points * lattice->padded[0];
    __global const scalar *along_z = along_y + lattice->sub_points * lattice->padded[1];
    const int last_sub = lattice->sub_points - 1;
    scalar x[LANES], y[LANES], z[LANES], reach[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        scalar side_x, side_y, side_z, other, ignored;
        middle_of(axes, cells, PLACE_X(place[lane]), lattice->last[0], x + lane, &side_x);
        middle_of(along_y, cells, PLACE_Y(place[lane]), lattice->last[1], y + lane, &side_y);
        middle_of(along_z, cells, PLACE_Z(place[lane]), lattice->last[2], z + lane, &side_z);
        if (last_sub > 0) {
            middle_of(axes + last_sub * lattice->padded[0], cells, PLACE_X(place[lane]), lattice->last[0], &other, &ignored);
            x[lane] = S(0.5) * (x[lane] + other);
            middle_of(along_y + last_sub * lattice->padded[1], cells, PLACE_Y(place[lane]), lattice->last[1], &other, &ignored);
            y[lane] = S(0.5) * (y[lane] + other);
            middle_of(along_z + last_sub * lattice->padded[2], cells, PLACE_Z(place[lane]), lattice->last[2], &other, &ignored);
            z[lane] = S(0.5) * (z[lane] + other);
        }
        side_x += lattice->margin[0];
        side_y += lattice->margin[1];
        side_z += lattice->margin[2];
        reach[lane] = sqrt(side_x * side_x + side_y * side_y + side_z * side_z);
    }
    const vec middle = vec_of(lanes_load(x), lanes_load(y), lanes_load(z));
    const sphere end = orbit_distance(middle, equal(R(0.0), R(0.0)), orbit, k);
    const real safe = end.step * (real)(lattice->step_scale);
    lanes_store(pick(less(lanes_load(reach), safe), R(1.0), R(0.0)), x);
    for (int lane = 0; lane < LANES; ++lane) empty[item * LANES + lane] = x[lane] != 0;
}
