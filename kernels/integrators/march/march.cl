// Entry points that know the formula: rays of a queue are marched, whatever they are for, and the surfaces that they met are
// looked at. Compiled once for each formula.
#include "formulas/orbits.h"
#include "integrators/march/rays.h"
#include "integrators/march/march.h"
#include "integrators/march/marches.h"

STAGE(march_rays) { MARCH_SHARES(0); }
#if LANES == 1
STAGE(look_at_surfaces) { LOOK_AT_SURFACES(0); }
#endif
