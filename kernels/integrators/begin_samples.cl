// Entry points: where samples begin. They know no formula.
#include "integrators/stages.h"
#include "integrators/march/cones.h"

// Sends the cones of blocks: a packet of lanes for a packet of blocks, of which the wave has `wave`.
STAGE(send_cones) {
    const pass span = PASS;
    const queue q = STAGE_QUEUE;
    const world w = WORLD;
    if (ITEM * LANES < wave && !WAS_CANCELLED) cones_send(span, q, ITEM * LANES, first_tile, w);
}

// Sends the rays from the eye. With several points to the pixel the ray only finds out how far the pixel's whole cone is free.
STAGE(begin_samples) {
    STAGE_BEGINS(s, w);
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const pixel p = sums_before(s, &here);
    const camera_sample a = camera_sample_of(s, &here, sample_wanted(s.span, &here.at, &p, sample));
    camera_sample_keep(s, &a);
    if (sample == first) count_waits_from(s.span, &here);
    counters cost = {R(0.0), R(0.0), R(0.0)};
    start_of_rays begin = {R(0.0)};
    if (turns > 0 && sample == first) {
        begin.t = cone_end(s, &here, s.tile - first_tile, &cost);
        STATE_KEEP(s, begin, STATE_START);
    } else if (turns > 0) {
        STATE_RECALL(s, begin, STATE_START);
    }
    STATE_KEEP(s, cost, STATE_COUNTERS);
    ray r = eye_ray(&a, view);
    r.footprint *= (real)(w.settings->touch_share);
    r.spread *= (real)(w.settings->touch_share);
    if (w.settings->eye_body > 0) {
        queue_skip(s.q, 0, s.slot);
        send_within_set(s, r, (real)((scalar)w.settings->eye_body), mask_of(a.wanted), w);
        return;
    }
    // A pixel's points look for objects on their own rays.
    send_clipped(s, 0, r, begin.t, settings->point_count > 1 ? GOES_PAST : WHICH, mask_of(a.wanted), w);
}
