// Entry points that know the formula: rays of a queue are marched, whatever they are for, and the surfaces that they met are
// looked at. Compiled once for each formula.
#include "orbits.h"
#include "rays.h"
#include "march.h"
#include "marches.h"

STAGE(march_rays) {
    const queue q = MARCH_QUEUE(0);
    const share mine = share_of_item(ITEM, slice, q);
    if (mine.next < mine.end && !WAS_CANCELLED) march_and_look(mine, q, goal, STATISTICS_HERE + STATISTIC_WAITS, settings, orbit, k);
}

#if LANES == 1
STAGE(look_at_surfaces) {
    const queue q = MARCH_QUEUE(0);
    if (ITEM < q.turns * q.wave && !WAS_CANCELLED) look_at(q, ITEM, settings, orbit, k);
}
#endif
