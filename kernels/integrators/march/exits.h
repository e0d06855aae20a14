// The surface where rays within glass leave the set.
#include "integrators/march/march_inside.h"
#include "integrators/march/share.h"
#include "integrators/march/surface_at.h"

#define EXIT_GRAZES R(0.05)   // least cosine of a ray with the normal where it leaves the set

// The rays within: each pixel's second one, which knows its body. `objects`: whether they meet any.
INLINE queue inside_of(__global scalar *rays, __global scalar *met, int wave, int stride, march_record settings, int objects) {
    return (queue){rays + wave, met + wave, wave, 1, stride, settings->met_numbers, objects, 1};
}

// The surface where a ray leaves solids is the one that a ray meets which comes the other way; its normal is told on the side of the inside.
INLINE ray_hit surface_behind(ray r, ray_hit e, mask hit, march_record settings, orbit_record orbit, constants k) {
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
    return e;
}

// The surface of solids that a ray comes to from what they displace.
INLINE ray_hit surface_ahead(ray r, ray_hit e, mask hit, march_record settings, orbit_record orbit, constants k) {
    e.touch = least(e.touch, e.t);
    e.last = e.t;
    surface_at(r, &e, hit, 0, settings, orbit, k);
    return e;
}

// Of several bodies the surface belongs to the one that displaces the other; `other` is the body beyond.
INLINE ray_hit surface_between(ray r, ray_hit e, mask hit, march_record settings, orbit_record orbit, constants k) {
    real body;
    orbit_bodies(vec_along(r.origin, e.last, r.direction), hit, r.known, &body, orbit, k);
    // A wall that is met before any place in it was tested has no such place.
    body = pick(equal(e.last, e.t), (real)((scalar)BODY_OPAQUE), body);
    // A ray that has not found its own body leaves it where it begins.
    const mask strays = less_equal(e.t, r.near) & less(body, (real)((scalar)BODY_OPAQUE));
    ray_hit found = e;
    for (int at = orbit->next_list, next = at; next > 0; at += next) {
        const real own = (real)((scalar)orbit[at].body);
        const mask ahead = hit & equal(body, own) & less(r.known, own) & ~strays;
        const mask behind = hit & equal(r.known, own) & (less(body, own) | strays);
        if (any_lane(ahead)) found = ray_hit_pick(ahead, surface_ahead(r, e, ahead, settings, orbit + at, k), found);
        if (any_lane(behind)) found = ray_hit_pick(behind, surface_behind(r, e, behind, settings, orbit + at, k), found);
        next = orbit[at].next_list;
    }
    found.other = pick(less(body, (real)((scalar)BODY_OPAQUE)), body, R(0.0));
    return found;
}

// Looks at the surfaces where rays of a queue from number `at` on leave their body.
INLINE void look_inside(queue q, int at, march_record settings, orbit_record orbit, constants k) {
    ray_hit e = queue_met(q, 0, at);
    mask hit = mask_of(e.hit);
    hit &= ~less(R(0.0), queue_object(q, 0, at, e));
    if (!any_lane(hit)) return;
    const ray r = queue_ray(q, 0, at);
    if (JOINED && orbit->next_list > 0) e = surface_between(r, e, hit, settings, orbit, k);
    else e = surface_behind(r, e, hit, settings, orbit, k);
    ray_hit_keep_surface(q, at, &e);
}

// The same for a packet's share, which has been marched; `waits` are counted in the launch's statistics.
INLINE void look_along_share(share mine, lane_waits waits, queue q, __global uint *statistics, march_record settings,
                             orbit_record orbit, constants k) {
    if (LANES == 1) return;
    for (int at = mine.next; at < mine.end; at += LANES) look_inside(q, at, settings, orbit, k);
    COUNT_LANE_WAITS(waits, statistics)
}
