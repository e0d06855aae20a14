// Entry points: what lights have brought to paths, where these go on, and their ends. They know no formula.
#include "integrators/path_stages.h"
#include "shading/plain_materials.h"

#define SOUGHT_BEYOND R(4.0)   // footprints

// How far a ray is marched for a flight: a surface just before its end is found some footprints beyond it.
INLINE real flight_sought(const path *so_far, const path_state *with, world w) {
    const real cone = (real)(w.settings->detail) * (so_far->footprint + so_far->spread * with->flight);
    return fmin(with->flight + SOUGHT_BEYOND * cone, (real)(REAL_LARGEST));
}

// What light brings through a clear body, where nothing was in the way of its rays. Nothing is awaited any more then.
INLINE color bent_gathered(stage s, int turn, int rays, counters *cost) {
    STATE_KEPT(s, bent, ways, STATE_BENT);
    mask met = less(R(1.0), R(0.0));
    for (int i = 0; i < rays; ++i) {
        const ray_hit answer = queue_met(s.q, turn + i, s.slot);
        counters_met(cost, answer, 0);
        met |= mask_of(answer.hit);
        queue_skip(s.q, turn + i, s.slot);
    }
    const color black = color_of(R(0.0), R(0.0), R(0.0)), found = color_pick(met, black, ways.awaited);
    for (int i = 0; i < 3; ++i) lanes_store(R(0.0), s.state + (bent_awaited(s) + i) * s.stride);
    return found;
}

// Adds the light that was sampled, where nothing is in its way, and sends the next ray of the path.
STAGE(gather_paths) {
    KEPT_PATH_STAGE_BEGINS(s, w, so_far, with);
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    const ray_hit answer = queue_met(s.q, 0, s.slot);
    counters_met(&cost, answer, 0);
    so_far.seen = color_pick(mask_of(answer.hit), so_far.seen, color_add(so_far.seen, with.awaited));
    if (KEEPS(s, STATE_BENT)) so_far.seen = color_add(so_far.seen, bent_gathered(s, next_turns, w.settings->chain_rays, &cost));
    STATE_KEEP(s, cost, STATE_COUNTERS);
    STATE_KEEP(s, so_far, STATE_PATH);
    real far = (real)(REAL_LARGEST);
    const mask within = is_within_set(&with, w);
    if (KEEPS(s, STATE_FLIGHT)) far = pick(within, far, flight_sought(&so_far, &with, w));
    const ray r = {so_far.origin, so_far.direction, R(0.0), far, so_far.footprint, so_far.spread, RAY_NOTHING_KNOWN};
    const mask on_path = mask_of(so_far.on_path);
    if (HAS(w, GLASS_SET)) send_within_set(s, r, body_of(with.medium), on_path & within, w);
    send_clipped(s, 0, r, R(0.0), WHICH, on_path & ~within, w);
}

// Ends the samples. The last ray of a path only finds out whether it leaves the set: else light that both ways could have found would
// have a part of its weight.
STAGE(end_paths) {
    STAGE_BEGINS(s, w);
    const camera_sample a = camera_sample_kept(s);
    STATE_KEPT(s, path, so_far, STATE_PATH);
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    path_state with = path_state_kept(s);
    const ray_hit last = queue_met(s.q, 0, s.slot);
    // (With light that is sought it has met an interaction, which has counted it.)
    if (!HAS(w, SOUGHT)) counters_met(&cost, last, 0);
    mask on_path = mask_of(so_far.on_path);
    on_path &= ~is_within_set(&with, w);
    real far = pick(on_path, pick(mask_of(last.hit), last.t, (real)(REAL_LARGEST)), R(0.0));
    light_hit before = light_hit_of(so_far.origin, so_far.direction, 0, &far, w);
    before.met &= on_path;
    if (HAS(w, GLASS)) path_absorbs(&so_far, &with, far, on_path, w);
    path_ends(s, &so_far, &with, &before, on_path & ~mask_of(last.hit), a.y, w);
    if (HAS(w, EMITTERS) && !HAS(w, SOUGHT)) path_ends_at_emitter(s, &so_far, &with, last, on_path & ~before.met, w);
    if (bounce == 1 && KEEPS(s, STATE_AOVS)) aovs_once(s, so_far.seen);
    const interaction first_interaction = interaction_kept(s, 0);
    end_samples(s, a, so_far.seen, &first_interaction, cost, w);
}
