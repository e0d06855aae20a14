// Entry points: objects beside the set. They know no formula.
#include "integrators/stages.h"
#include "integrators/lane_shares.h"

// Finds the first object on each of a packet's rays that `waits` for it, of which those that are `wanted` have a length: the march ends there.
// A ray that asks only for something nearer is not marched.
INLINE void rays_meet_objects(queue q, int at, mask waits, mask wanted, world w) {
    __global scalar *numbers = q.rays + at;
    const real before = lanes_load_at(numbers + RAY_OBJECT_NUMBER * q.stride, &q.lanes);
    const real longest = lanes_load_at(numbers + RAY_OBJECT * q.stride, &q.lanes);
    const real enough = lanes_load_at(numbers + RAY_OBJECT_PLACE * q.stride, &q.lanes);
    ray r = queue_ray(q, 0, at);
    const real far = r.far;
    real number = R(0.0), nearest = (real)(REAL_LARGEST);
    if (any_lane(wanted)) {
        r.far = longest;
        nearest = pick(wanted, objects_met(&r, w.objects, w.planes, w.settings->object_count, w.tables, &number), nearest);
    }
    lanes_store_at(pick(waits, nearest, longest), numbers + RAY_OBJECT * q.stride, &q.lanes);
    lanes_store_at(pick(waits, number, before), numbers + RAY_OBJECT_NUMBER * q.stride, &q.lanes);
    const mask ends = waits & less_equal(R(0.0), enough);
    lanes_store_at(pick(ends, pick(less_equal(enough, nearest), fmin(far, nearest), R(-1.0)), far), numbers + RAY_FAR * q.stride, &q.lanes);
}

// The rays of a packet that wait for that, and of these the ones with a length.
INLINE mask rays_waiting(queue q, int at, mask *wanted) {
    const mask waits = less(lanes_load(q.rays + RAY_OBJECT_NUMBER * q.stride + at), R(0.0));
    *wanted = waits & less_equal(R(0.0), lanes_load(q.rays + RAY_OBJECT * q.stride + at));
    return waits;
}

// Finds the first object on each ray that was sent.
STAGE(meet_objects) {
    queue q = OBJECTS_QUEUE;
    const world w = WORLD;
    if (WAS_CANCELLED) return;
#if LANES == 1
    mask wanted;
    if (ITEM >= q.turns * q.wave) return;
    const mask waits = rays_waiting(q, ITEM, &wanted);
    if (waits) rays_meet_objects(q, ITEM, waits, wanted, w);
#else
    const int begin = ITEM * LANE_SHARE, beyond = min(begin + LANE_SHARE, q.turns * q.wave);
    lane_list left;
    left.found = left.taken = 0;
    int at = begin, numbers[LANES];
    for (;;) {
        mask waits, wanted;
        if (at < beyond) {
            waits = rays_waiting(q, at, &wanted);
            const uint those = lanes_bits(wanted);
            if (bits_count(those) <= FEW_LANES) {
                lanes_listed(&left, those, at - begin);
                waits &= ~wanted;
                wanted &= ~wanted;
            }
        } else {
            if (!lanes_taken(&left, numbers, &q.lanes)) return;
            waits = wanted = less(R(0.0), R(1.0));
        }
        if (any_lane(waits)) rays_meet_objects(q, at < beyond ? at : begin, waits, wanted, w);
        if (at < beyond) at += LANES;
    }
#endif
}

// The count on the face of an object's cut: all that the plane takes. Of other things that are no formulas it is 0.
INLINE real face_count(real thing, world w) {
    real count = R(0.0);
    const real plane = plane_of_face(thing);
    for (int i = 0; i < w.planes.count; ++i) count = pick(equal(plane, (real)((scalar)i)), (real)((scalar)w.planes.planes[i].iterations), count);
    return count;
}

// Looks at the objects that rays have met: their normals, the places where they are shaded, and faces of their cuts.
STAGE(look_at_objects) {
    const queue q = OBJECTS_QUEUE;
    const world w = WORLD;
    const int at = ITEM * LANES;
    if (at >= q.turns * q.wave || WAS_CANCELLED) return;
    const ray_hit seen = queue_met(q, 0, at);
    const real number = queue_object(q, 0, at, seen);
    const mask here = less(R(0.0), number);
    if (!any_lane(here)) return;
    const ray r = queue_ray(q, 0, at);
    const vec point = vec_along(r.origin, seen.t, r.direction);
    vec place = objects_place(&point, number, w.objects, settings->object_count);
    vec normal = objects_normal(&point, &r.direction, number, w.objects, settings->object_count, w.tables);
    const real thing = objects_faced(r.origin, r.direction, number, w.objects, w.planes, settings->object_count, &normal, point, &place);
    ray_hit found = ray_hit_kept(q, at);
    found.normal = vec_pick(here, normal, found.normal);
    found.smooth = pick(here, face_count(thing, w), found.smooth);
    found.more_steps = pick(here, R(0.0), found.more_steps);
    found.more_count = pick(here, R(0.0), found.more_count);
    ray_hit_keep_surface(q, at, &found);
    __global scalar *numbers = q.rays + at;
    const real before = lanes_load(numbers + RAY_OBJECT_NUMBER * q.stride);
    lanes_store(pick(here, thing, before), numbers + RAY_OBJECT_NUMBER * q.stride);
    KEEP(place, numbers + RAY_OBJECT_PLACE * q.stride, q.stride);
}
