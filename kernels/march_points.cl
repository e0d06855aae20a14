// The same where pixels have points. What their rays know already is one number more in a march, and takes a twentieth more time.
#include "orbits.h"
#include "rays.h"
#include "march.h"
#include "marches.h"

STAGE(march_points) { MARCH_SHARES(1); }
#if LANES == 1
STAGE(look_at_points) { LOOK_AT_SURFACES(1); }
#endif
