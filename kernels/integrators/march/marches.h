// What texts that march rays of a queue say behind their search: what the kernels of a search do. `known`: whether something may be
// known of rays. A share is marched, and the surfaces that it meets are looked at; single lanes look in a kernel of its own.
#include "integrators/march/queue.h"
#include "integrators/march/share.h"
#include "integrators/arguments.h"
#include "integrators/march/surface_at.h"

// Nobody counts the steps that lanes of cones have waited.
#define MARCH_SHARES(known)                                                                        \
    const queue q = MARCH_QUEUE(known);                                                            \
    const share mine = share_of_item(ITEM, slice, q);                                              \
    if (mine.next >= mine.end || WAS_CANCELLED) return;                                            \
    const int waits = march_share(mine, q, goal, settings, orbit, k);                              \
    look_at_share(mine, q, goal, settings, orbit, k);                                              \
    if (LANES > 1 && goal != GOAL_CONE) atomic_add(STATISTICS_HERE + STATISTIC_WAITS, (uint)waits)
#define LOOK_AT_SURFACES(known)                                                                    \
    const queue q = MARCH_QUEUE(known);                                                            \
    if (ITEM < q.turns * q.wave && !WAS_CANCELLED) look_at(q, ITEM, settings, orbit, k)
