// Entry points that know the formula: paths within a set that scatters light go on to where they leave it. Their rays are the second ones
// of the queue.
#include "formulas/orbits.h"
#include "integrators/march/rays.h"
#include "integrators/stages.h"
#include "shading/phase.h"
#include "shading/set_lights.h"
#include "shading/light_places.h"
#include "shading/flights.h"
#include "integrators/march/exits.h"
#include "integrators/random_walk.h"

STAGE(walk_inside) {
    const queue q = inside_of(rays, met, wave, queue_stride, settings, settings->meets_objects);
    const share mine = share_of_item(ITEM, slice, q);
    if (mine.next >= mine.end || WAS_CANCELLED) return;
    const world w = WORLD;
    const lane_waits waits = walk_share(mine, q, state, wave + STATE_PADDING, bounce, w, orbit, k);
    look_along_share(mine, waits, q, STATISTICS_HERE, settings, orbit, k);
}

#if LANES == 1
STAGE(look_where_walks_end) {
    const queue q = inside_of(rays, met, wave, queue_stride, settings, settings->meets_objects);
    if (ITEM < q.turns * q.wave && !WAS_CANCELLED) look_inside(q, ITEM, settings, orbit, k);
}
#endif
