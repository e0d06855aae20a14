// Entry points that know the formula: the march of march.cl where pixels have points. What rays know already is one number more.
#include "formulas/orbits.h"
#include "integrators/march/rays.h"
#include "integrators/march/march.h"
#include "integrators/march/marches.h"

STAGE(march_points) { MARCH_SHARES(1); }
#if LANES == 1
STAGE(look_at_points) { LOOK_AT_SURFACES(1); }
#endif
