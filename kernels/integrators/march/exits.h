// The surface where rays within glass leave the set.
#include "integrators/march/march_inside.h"
#include "integrators/march/share.h"
#include "integrators/march/surface_at.h"

#define EXIT_GRAZES R(0.05)   // least cosine of a ray with the normal where it leaves the set

// The rays within: each pixel's second one. `objects`: whether they meet any.
INLINE queue inside_of(__global scalar *rays, __global scalar *met, int wave, int stride, march_record settings, int objects) {
    return (queue){rays + wave, met + wave, wave, 1, stride, settings->met_numbers, objects, 0};
}

// Looks at the surfaces where rays of a queue from number `at` on leave the set. It is the surface that a ray meets which comes
// the other way; its normal is told on the side of the inside.
INLINE void look_inside(queue q, int at, march_record settings, orbit_record orbit, constants k) {
    ray_hit e = queue_met(q, 0, at);
    mask hit = mask_of(e.hit);
    hit &= ~less(R(0.0), queue_object(q, 0, at, e));
    if (!any_lane(hit)) return;
    ray r = queue_ray(q, 0, at);
    r.footprint += r.spread * e.t;
    r.spread = R(0.0);
    r.origin = vec_along(r.origin, e.touch, r.direction);
    r.direction = vec_scale(r.direction, R(-1.0));
    const real beyond = e.touch, t = e.t;
    e.t = beyond - t;
    e.last = beyond - e.last;
    e.touch = R(0.0);
    surface_at(r, &e, hit, 0, settings, orbit, k);
    // A sheet without an inside lets rays straight through.
    const mask sheet = less_equal(t, r.near);
    e.normal = vec_pick(sheet, r.direction, vec_scale(e.normal, R(-1.0)));
    // What leaves the set does not come from beyond it: a normal that says so is turned until the ray grazes.
    const real facing = vec_dot(e.normal, r.direction);
    const vec turned = vec_normalize(vec_along(e.normal, EXIT_GRAZES - facing, r.direction));
    e.normal = vec_pick(less(facing, EXIT_GRAZES), turned, e.normal);
    e.touch = beyond - e.touch;
    e.t = t;
    ray_hit_keep_surface(q, at, &e);
}

// The same for a packet's share, which has been marched; `waits` are counted in the launch's statistics.
INLINE void look_along_share(share mine, lane_waits waits, queue q, __global uint *statistics, march_record settings,
                             orbit_record orbit, constants k) {
    if (LANES == 1) return;
    for (int at = mine.next; at < mine.end; at += LANES) look_inside(q, at, settings, orbit, k);
    COUNT_LANE_WAITS(waits, statistics)
}
