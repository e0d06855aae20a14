// The distance used for marching: the cheapest that the formula offers; and an orbit for it that a march may leave under way.
#include "formulas/dual_orbits.h"
#include "formulas/scalar_orbits.h"

#if HAS_DERIVATIVE
typedef scalar_orbit march_orbit;
#else
typedef dual_orbit march_orbit;

INLINE clearance formula_distance(vec point, mask active, orbit_record orbit, constants k) {
    surface_point ignored;
    return formula_dual_distance(point, active, OF_DISTANCE, orbit, k, &ignored);
}
#endif
