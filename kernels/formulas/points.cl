// Entry points for lists of points: escape counts, and distances with normals. One work-item takes LANES points in a row.
#include "formulas/orbits.h"

// Points are stored as all x, then all y, then all z, each `stride` numbers long; `stride` is a multiple of LANES.
INLINE vec load_point(__global const scalar *points, int stride, int first) {
    return vec_of(lanes_load(points + first), lanes_load(points + stride + first), lanes_load(points + 2 * stride + first));
}

INLINE void store_whole(__global int *result, int first, mask value) {
    int each[LANES];
#if REAL_IS_DOUBLE && LANES > 1
    lanes_store(CONVERT(OF_LANES(int), value), each);
#else
    lanes_store(value, each);
#endif
    for (int lane = 0; lane < LANES; ++lane) result[first + lane] = each[lane];
}

// Of a formula by itself. result: escape counts, then 1 for points that never escaped.
__kernel void escape_counts(__global const scalar *points, __global int *result, int stride, orbit_record orbit, constants k) {
    if (orbit_cancelled(orbit)) return;
    const int first = (int)get_global_id(0) * LANES;
    const vec point = load_point(points, stride, first);
    const orbit_counted end = formula_escape_count(point, equal(R(0.0), R(0.0)), orbit, k);
    store_whole(result, first, end.count);
    store_whole(result, stride + first, -end.inside);
}

// result: the marching distance, the Jacobian's distance, the Jacobian's gradient x, y, z (length 1; inside it is that of |z|
// after the last application), smooth count, inside; of several solids the number of the object that is nearest.
__kernel void distances(__global const scalar *points, __global scalar *result, int stride, orbit_record orbit, constants k) {
    if (orbit_cancelled(orbit)) return;
    const int first = (int)get_global_id(0) * LANES;
    const vec point = load_point(points, stride, first);
    const mask all_lanes = equal(R(0.0), R(0.0));
    surface_point surface;
    const clearance near = orbit_distance(point, all_lanes, orbit, k);
    const clearance full = orbit_dual_distance(point, all_lanes, OF_SURFACE, orbit, k, &surface);
    const vec normal = vec_normalize(surface.gradient);
    const real found[8] = {near.step, full.step, normal.x, normal.y, normal.z, smooth_count(full.end, surface, orbit),
                           pick(full.end.inside, R(1.0), R(0.0)), JOINED ? surface.own.solid : R(0.0)};
    for (int i = 0; i < (JOINED ? 8 : 7); ++i) lanes_store(found[i], result + i * stride + first);
}
