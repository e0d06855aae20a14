// Entry points that know the formula: rays of a queue are marched, whatever they are for, and the surfaces that they met are
// looked at. Compiled once for each formula and search.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "solids.h"
#include "rays.h"
#if SEARCH == SEARCH_STEPS
#include "march_steps.h"
#else
#include "march_state.h"
#include "passed.h"
#include "proof.h"
#include "march.h"
#endif
#include "queue.h"
#include "share.h"
#include "arguments.h"
#include "surface_at.h"

// Marches all rays of a queue, each work-item its share.
STAGE(march_rays) {
    const queue q = MARCH_QUEUE;
    const share mine = share_of_item(ITEM, slice, q);
    if (mine.next >= mine.end || WAS_CANCELLED) return;
    const int waits = march_share(mine, q, goal, settings, orbit, k);
    look_at_share(mine, q, goal, settings, orbit, k);
    // Nobody counts those of the cones.
    if (LANES > 1 && goal != GOAL_CONE) atomic_add(statistics + STATISTICS * (first_tile * (TILE * TILE / LANES) + first_packet) + STATISTIC_WAITS, (uint)waits);
}

#if LANES == 1
STAGE(look_at_surfaces) {
    const queue q = MARCH_QUEUE;
    const int at = ITEM;
    if (at < q.turns * q.wave && !WAS_CANCELLED) look_at(q, at, settings, orbit, k);
}
#endif
