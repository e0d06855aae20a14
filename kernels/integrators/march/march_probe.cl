// Marches rays that the host has made, and looks at the surfaces that they meet, to measure how fast a device does that with packets
// of LANES rays. Nothing is shaded, so it compiles in a fraction of a renderer's time; a picture's time is mostly that of the same.
#include "formulas/orbits.h"
#include "integrators/march/rays.h"
#include "integrators/march/march.h"
#include "integrators/march/queue.h"
#include "integrators/march/share.h"
#include "integrators/march/surface_at.h"

// `rays` and `met`: a queue of `wave` rays, with `stride` from one number of a ray to its next; each work-item marches a share.
__kernel void march_probe(__global scalar *rays, __global scalar *met, march_record settings,
                          orbit_record orbit, constants k, int wave, int stride, int slice, int goal) {
    const queue q = {rays, met, wave, 1, stride, ENCOUNTER_SOLID, 0, 0};
    const share mine = share_of_item((int)get_global_id(0), slice, q);
    if (mine.next >= mine.end) return;
    march_share(mine, q, goal, settings, orbit, k);
    look_at_share(mine, q, goal, settings, orbit, k);
}
