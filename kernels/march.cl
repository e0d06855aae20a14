// Entry points that know the formula: rays of a queue are marched, whatever they are for, and the surfaces that they met are
// looked at. Compiled once for each formula.
#include "orbits.h"
#include "rays.h"
#include "march.h"
#include "marches.h"

STAGE(march_rays) { MARCH_SHARES(0); }
#if LANES == 1
STAGE(look_at_surfaces) { LOOK_AT_SURFACES(0); }
#endif
