// Entry points that know the formula: rays within glass go on to where they leave the set. They are the second ones of the queue.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "rays.h"
#include "queue.h"
#include "arguments.h"
#if HAS_GLASS_SCATTER
#include "sampling.h"
#include "shade.h"
#include "tiles.h"
#include "pixel.h"
#include "planes.h"
#include "stage.h"
#include "state.h"
#include "eye.h"
#include "phase.h"
#include "set_lights.h"
#include "light_places.h"
#include "flights.h"
#endif
#include "march_inside.h"
#include "share.h"
#include "surface_at.h"
#include "exits.h"
#if HAS_GLASS_SCATTER
#include "walks.h"
#endif

STAGE(march_inside) {
    const queue q = inside_of(rays, met, wave, queue_stride, settings);
    const share mine = share_of_item(ITEM, slice, q);
    if (mine.next >= mine.end || WAS_CANCELLED) return;
#if HAS_GLASS_SCATTER
    const world w = WORLD;
    const int waits = walk_share(mine, q, state, wave + STATE_PADDING, bounce, w, orbit, k);
#else
    const int waits = march_share(mine, q, goal, settings, orbit, k);
#endif
    if (LANES == 1) return;
    for (int at = mine.next; at < mine.end; at += LANES) look_inside(q, at, settings, orbit, k);
    atomic_add(statistics + STATISTICS * (first_tile * (TILE * TILE / LANES) + first_packet) + STATISTIC_WAITS, (uint)waits);
}

#if LANES == 1
STAGE(look_inside_set) {
    const queue q = inside_of(rays, met, wave, queue_stride, settings);
    const int at = ITEM;
    if (at < q.turns * q.wave && !WAS_CANCELLED) look_inside(q, at, settings, orbit, k);
}
#endif
