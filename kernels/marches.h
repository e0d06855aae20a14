// What texts that march rays of a queue say behind their search.
#include "queue.h"
#include "share.h"
#include "arguments.h"
#include "surface_at.h"

// Marches a share, and looks at the surfaces that it meets; `waiting` counts the steps that lanes have waited.
INLINE void march_and_look(share mine, queue q, int goal, __global uint *waiting, march_record settings,
                           orbit_record orbit, constants k) {
    const int waits = march_share(mine, q, goal, settings, orbit, k);
    look_at_share(mine, q, goal, settings, orbit, k);
    // Nobody counts those of the cones.
    if (LANES > 1 && goal != GOAL_CONE) atomic_add(waiting, (uint)waits);
}
