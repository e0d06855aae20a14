// Entry points: light that is sought, of things that shine by maps, or whose shape is not known. Rays towards them have met something: that is
// asked what it shines with, by the stages that ask interactions (`color_interactions`, `find_materials`). They know no formula.
#include "integrators/path_stages.h"
#include "shading/plain_materials.h"

// What a packet's present interaction shines with.
INLINE color sought_shines(stage s, const interaction *here, world w) {
    const pbr p = pbr_of_interaction(s, here, w);
    return color_scale(p.emission_color, p.emission_luminance);
}

// What a ray in search of light brings from what `find_sought` has found, unless a lamp is before it: no lane is `lit` else.
INLINE color sought_brings(stage s, int turn, const sought *seeks, mask *lit, world w) {
    const interaction found = interaction_kept(s, 1);
    *lit = mask_of(found.found);
    if (!any_lane(*lit)) return color_of(R(0.0), R(0.0), R(0.0));
    const ray r = queue_ray(s.q, turn, s.slot);
    real far = way_to_interaction(&found, r);
    const real way = pick(*lit, far, R(0.0));
    *lit &= ~light_hit_of(r.origin, r.direction, 0, &far, w).met;
    const color brings = color_mul(seeks->brings, sought_shines(s, &found, w));
    return HAS(w, GLASS) ? absorbed(brings, seeks->extinction, way) : brings;
}

// Makes interactions of what the rays of a turn have met, as far as they are `wanted`. (Planes open no set here that shines: no face is asked.)
INLINE interaction interaction_met(stage s, int turn, ray r, mask wanted, world w) {
    real object;
    vec place;
    const ray_hit seen = surface_met(s, turn, r, &object, &place, w);
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    counters_met(&cost, seen, 1);
    STATE_KEEP(s, cost, STATE_COUNTERS);
    interaction found = interaction_of_ray(r, seen, object, place, w);
    found.found = number_of(wanted & mask_of(seen.hit));
    return found;
}

// What rays of the turn `next_turns` have met, where that is what they seek. It stands where the path's next interaction will.
STAGE(find_sought) {
    STAGE_BEGINS(s, w);
    STATE_KEPT(s, sought, seeks, STATE_SOUGHT);
    const mask wanted = less(R(0.0), seeks.thing);
    interaction found = {R(0.0)};
    if (any_lane(wanted)) {
        found = interaction_met(s, next_turns, queue_ray(s.q, next_turns, s.slot), wanted, w);
        found.found = number_of(mask_of(found.found) & equal(found.object + R(1.0), seeks.thing));
    }
    interaction_keep(s, &found, 1);
}

// Adds what is sought in the air to what its turn brings, which nothing else does there (`air_rays.cl`).
STAGE(gather_sought_air) {
    STAGE_BEGINS(s, w);
    STATE_KEPT(s, sought, seeks, STATE_SOUGHT);
    if (!any_lane(less(R(0.0), seeks.thing))) return;
    mask lit;
    const color brings = sought_brings(s, next_turns, &seeks, &lit, w);
    if (any_lane(lit)) {
        color light;
        STATE_RECALL_ONE(s, light, STATE_AIR, 1 + w.settings->air_sun);
        light = color_pick(lit, color_add(light, brings), light);
        STATE_KEEP_ONE(s, light, STATE_AIR, 1 + w.settings->air_sun);
    }
    queue_skip(s.q, next_turns, s.slot);
}

// What the last rays of paths have met.
STAGE(find_last) {
    PATH_STAGE_BEGINS(s, w);
    const camera_sample a = camera_sample_kept(s);
    path so_far;
    const ray r = path_ray(s, eye_ray(&a, view), a.wanted, &so_far);
    const interaction found = interaction_met(s, 0, r, mask_of(so_far.on_path), w);
    interaction_keep(s, &found, bounce);
}

// Adds what they shine with, unless a lamp is before them. Nothing is sought any more then.
STAGE(gather_sought) {
    STAGE_BEGINS(s, w);
    STATE_KEPT(s, sought, seeks, STATE_SOUGHT);
    if (!any_lane(less(R(0.0), seeks.thing))) return;
    mask lit;
    color brings = sought_brings(s, next_turns, &seeks, &lit, w);
    if (any_lane(lit)) {
        if (bounce > 0) brings = limited(brings, w.settings);
        STATE_KEPT(s, path, so_far, STATE_PATH);
        so_far.seen = color_pick(lit, color_add(so_far.seen, brings), so_far.seen);
        STATE_KEEP(s, so_far, STATE_PATH);
    }
    seeks.thing = R(0.0);
    STATE_KEEP(s, seeks, STATE_SOUGHT);
    queue_skip(s.q, next_turns, s.slot);
}

// Adds the light of what shines where the last ray of a path has met it: as far as the path could also have sampled it there.
STAGE(end_sought) {
    PATH_STAGE_BEGINS(s, w);
    const interaction found = interaction_kept(s, bounce);
    STATE_KEPT(s, path, so_far, STATE_PATH);
    const path_state with = path_state_kept(s);
    mask here = mask_of(so_far.on_path) & mask_of(found.found) & is_emitter(found.object, w);
    here &= ~is_within_set(&with, w);
    if (!any_lane(here)) return;
    const ray last = {so_far.origin, so_far.direction, R(0.0), R(0.0), R(0.0), R(0.0), RAY_NOTHING_KNOWN};
    real far = way_to_interaction(&found, last);
    const real way = pick(here, far, R(0.0));
    here &= ~light_hit_of(so_far.origin, so_far.direction, 0, &far, w).met;
    path comes = so_far;
    if (HAS(w, GLASS)) path_absorbs(&comes, &with, way, here, w);
    const real share = emitter_share(so_far.origin, so_far.direction, way, found.object, with.density, with.total, w);
    path_sees(s, &so_far, color_mul(color_scale(sought_shines(s, &found, w), share), comes.through), here, w);
    STATE_KEEP(s, so_far, STATE_PATH);
}
