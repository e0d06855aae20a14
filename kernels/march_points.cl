// The same where pixels have points. What their rays know already is one number more in a march, and takes a twentieth more time.
#include "orbits.h"
#include "rays.h"
#include "march.h"
#include "marches.h"

STAGE(march_points) {
    const queue q = MARCH_QUEUE(1);
    const share mine = share_of_item(ITEM, slice, q);
    if (mine.next < mine.end && !WAS_CANCELLED) march_and_look(mine, q, goal, STATISTICS_HERE + STATISTIC_WAITS, settings, orbit, k);
}

#if LANES == 1
STAGE(look_at_points) {
    const queue q = MARCH_QUEUE(1);
    if (ITEM < q.turns * q.wave && !WAS_CANCELLED) look_at(q, ITEM, settings, orbit, k);
}
#endif
