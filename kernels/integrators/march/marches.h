// What texts that march rays of a queue say behind their search: what the kernels of a search do. `known`: whether something may be
// known of rays. A share is marched, and the surfaces that it meets are looked at; single lanes look in a kernel of its own.
#include "integrators/march/queue.h"
#include "integrators/march/share.h"
#include "integrators/arguments.h"
#include "integrators/march/surface_at.h"

// Nobody counts how long lanes of cones have waited.
#define MARCH_SHARES(known)                                                                        \
    const queue q = MARCH_QUEUE(known);                                                            \
    const share mine = share_of_item(ITEM, slice, q);                                              \
    if (mine.next >= mine.end || WAS_CANCELLED) return;                                            \
    const lane_waits waits = march_share(mine, q, goal, settings, orbit, k);                       \
    look_at_share(mine, q, goal, settings, orbit, k);                                              \
    if (goal != GOAL_CONE) COUNT_LANE_WAITS(waits, STATISTICS_HERE)
#define LOOK_AT_SURFACES(known)                                                                    \
    const queue q = MARCH_QUEUE(known);                                                            \
    if (ITEM < q.turns * q.wave && !WAS_CANCELLED) look_at(q, ITEM, settings, orbit, k)
