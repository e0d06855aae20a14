// Entry points that know the formula: rays within clear glass go on to where they leave the set. They are the second ones of the queue.
#include "formulas/orbits.h"
#include "integrators/march/rays.h"
#include "integrators/march/queue.h"
#include "integrators/arguments.h"
#include "integrators/march/exits.h"

STAGE(march_inside) {
    const queue q = inside_of(rays, met, wave, queue_stride, settings, 0);
    const share mine = share_of_item(ITEM, slice, q);
    if (mine.next >= mine.end || WAS_CANCELLED) return;
    const lane_waits waits = march_share(mine, q, goal, settings, orbit, k);
    look_along_share(mine, waits, q, STATISTICS_HERE, settings, orbit, k);
}

#if LANES == 1
STAGE(look_inside_set) {
    const queue q = inside_of(rays, met, wave, queue_stride, settings, 0);
    if (ITEM < q.turns * q.wave && !WAS_CANCELLED) look_inside(q, ITEM, settings, orbit, k);
}
#endif
