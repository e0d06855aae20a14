// Entry points that know the formula: the march of march.cl where pixels have points. What rays know already is one number more.
#include "orbits.h"
#include "rays.h"
#include "march.h"
#include "marches.h"

STAGE(march_points) { MARCH_SHARES(1); }
#if LANES == 1
STAGE(look_at_points) { LOOK_AT_SURFACES(1); }
#endif
