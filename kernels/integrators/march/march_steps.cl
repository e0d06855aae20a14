// Entry points that know the formula: rays of a queue are marched by steps, the other search for the surface.
#include "formulas/orbits.h"
#include "integrators/march/rays.h"
#include "integrators/march/march_steps.h"
#include "integrators/march/marches.h"

STAGE(step_rays) { MARCH_SHARES(settings->point_count > 1); }
#if LANES == 1
STAGE(look_where_steps_end) { LOOK_AT_SURFACES(settings->point_count > 1); }
#endif
