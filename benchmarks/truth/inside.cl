// Which points belong to the solid that the search for a surface looks for. One work-item takes LANES points in a row.
#include "device/lanes.h"
#include "formulas/numbers/real.h"
#include "formulas/numbers/powers.h"
#include "device/vectors.h"
#include "structs.h"
#include "formula.h"
#include "formulas/orbit.h"

// Points are stored as all x, then all y, then all z, each `stride` numbers long; `stride` is a multiple of LANES.
__kernel void inside(__global const scalar *points, __global char *result, int stride, __constant const struct Orbit *orbit,
                     __constant const scalar *k) {
    const int first = (int)get_global_id(0) * LANES;
    scalar x[LANES], y[LANES], z[LANES], found[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        x[lane] = points[first + lane];
        y[lane] = points[stride + first + lane];
        z[lane] = points[2 * stride + first + lane];
    }
    const vec point = vec_of(lanes_load(x), lanes_load(y), lanes_load(z));
    const orbit_end end = formula_end(point, equal(R(0.0), R(0.0)), orbit->iterations, orbit, k);
    lanes_store(pick(end.inside, R(1.0), R(0.0)), found);
    for (int lane = 0; lane < LANES; ++lane) result[first + lane] = found[lane] > S(0.5);
}
