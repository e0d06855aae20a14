// Entry points for lists of points: escape counts, and distances with normals. One work-item takes LANES points in a row.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "solids.h"

// Points are stored as all x, then all y, then all z, each `stride` numbers long; `stride` is a multiple of LANES.
INLINE vec load_point(__global const scalar *points, int stride, int first) {
    scalar x[LANES], y[LANES], z[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        x[lane] = points[first + lane];
        y[lane] = points[stride + first + lane];
        z[lane] = points[2 * stride + first + lane];
    }
    return vec_of(lanes_load(x), lanes_load(y), lanes_load(z));
}

INLINE void store_plane(__global scalar *result, int first, real value) {
    scalar each[LANES];
    lanes_store(value, each);
    for (int lane = 0; lane < LANES; ++lane) result[first + lane] = each[lane];
}

INLINE void store_whole(__global int *result, int first, mask value) {
    int each[LANES];
#if REAL_IS_DOUBLE && LANES > 1
    lanes_store(JOIN(convert_int, LANES)(value), each);
#else
    lanes_store(value, each);
#endif
    for (int lane = 0; lane < LANES; ++lane) result[first + lane] = each[lane];
}

// Of a formula by itself. result: escape counts, then 1 for points that never escaped.
__kernel void escape_counts(__global const scalar *points, __global int *result, int stride,
                            __constant const struct Orbit *orbit, __constant const scalar *k) {
    if (orbit_cancelled(orbit)) return;
    const int first = (int)get_global_id(0) * LANES;
    const vec point = load_point(points, stride, first);
    const orbit_counted end = formula_escape_count(point, equal(R(0.0), R(0.0)), orbit, k);
    store_whole(result, first, end.count);
    store_whole(result, stride + first, -end.inside);
}

// result: the marching distance, the Jacobian's distance, the Jacobian's gradient x, y, z (length 1; inside it is that of |z|
// after the last application), smooth count, inside; of several solids the number of the object that is nearest.
__kernel void distances(__global const scalar *points, __global scalar *result, int stride,
                        __constant const struct Orbit *orbit, __constant const scalar *k) {
    if (orbit_cancelled(orbit)) return;
    const int first = (int)get_global_id(0) * LANES;
    const vec point = load_point(points, stride, first);
    const mask all_lanes = equal(R(0.0), R(0.0));
    surface_point surface;
    const clearance near = orbit_distance(point, all_lanes, orbit, k);
    const clearance full = orbit_dual_distance(point, all_lanes, OF_SURFACE, orbit, k, &surface);
    const vec normal = vec_normalize(surface.gradient);
    store_plane(result, first, near.step);
    store_plane(result, stride + first, full.step);
    store_plane(result, 2 * stride + first, normal.x);
    store_plane(result, 3 * stride + first, normal.y);
    store_plane(result, 4 * stride + first, normal.z);
    store_plane(result, 5 * stride + first, smooth_count(full.end, surface, orbit));
    store_plane(result, 6 * stride + first, pick(full.end.inside, R(1.0), R(0.0)));
    if (JOINED) store_plane(result, 7 * stride + first, surface.solid);
}
