// Entry points: direct light that does not come from points. They know no formula.
#include "integrators/light_stages.h"
#include "integrators/wide_lights.h"

// Sends all rays that bring the interactions' light.
STAGE(send_to_lights) {
    STAGE_BEGINS(s, w);
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const interaction found = interaction_kept(s, bounce);
    send_to_wide_lights(s, &here.at, &found, next_turns, w);
}

// Gathers what these have brought.
STAGE(gather_light) {
    STAGE_BEGINS(s, w);
    interaction found = interaction_kept(s, bounce);
    if (!any_lane(mask_of(found.found))) return;
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    const camera_sample a = camera_sample_kept(s);
    path so_far;
    const vec direction = path_ray(s, eye_ray(&a, view), a.wanted, &so_far).direction;
    if (!is_colored_at_once(w.material)) found.tint = tint_of(&found, w);
    const color gathered = wide_light_gathered(s, &found, vec_scale(direction, R(-1.0)), &cost, w);
    STATE_KEEP(s, gathered, STATE_GATHERED);
    STATE_KEEP(s, cost, STATE_COUNTERS);
}

// Finds the lights that are before what rays along the path have met.
STAGE(meet_lights) {
    STAGE_BEGINS(s, w);
    interaction found = interaction_kept(s, bounce);
    const camera_sample a = camera_sample_kept(s);
    path so_far;
    const ray arrived = path_ray(s, eye_ray(&a, view), a.wanted, &so_far);
    path_meets_light(s, &so_far, &found, arrived, w);
}
