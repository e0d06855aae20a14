// The same by the other search for the surface.
#include "orbits.h"
#include "rays.h"
#include "march_steps.h"
#include "marches.h"

STAGE(step_rays) {
    const queue q = MARCH_QUEUE(settings->point_count > 1);
    const share mine = share_of_item(ITEM, slice, q);
    if (mine.next < mine.end && !WAS_CANCELLED) march_and_look(mine, q, goal, STATISTICS_HERE + STATISTIC_WAITS, settings, orbit, k);
}

#if LANES == 1
STAGE(look_where_steps_end) {
    const queue q = MARCH_QUEUE(settings->point_count > 1);
    if (ITEM < q.turns * q.wave && !WAS_CANCELLED) look_at(q, ITEM, settings, orbit, k);
}
#endif
