// Entry points: media that scatter light beside the set, which are clouds, milk and what is below boundaries. They know no formula.
#include "integrators/path_stages.h"
#include "shading/plain_materials.h"
#include "shading/participating_media.h"
#include "geometry/clouds.h"

// Finds the paths that a medium scatters before what they have met, and halts them there. Glass has then scattered them, and in clouds
// `walk_clouds` does: the stage of interactions leaves both alone. Last rays that are scattered are nobody's.
STAGE(cross_media) {
    PATH_STAGE_BEGINS(s, w);
    const int is_last = bounce > w.settings->bounces;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const camera_sample a = camera_sample_kept(s);
    path so_far;
    const ray arrived = path_ray(s, eye_ray(&a, view), a.wanted, &so_far);
    path_state with;
    if (bounce > 0) {
        with = path_state_kept(s);
    } else {
        so_far.origin = arrived.origin;
        so_far.direction = arrived.direction;
        so_far.footprint = arrived.footprint;
        so_far.spread = arrived.spread;
        with = path_state_from_eye(arrived.origin, w);
        if (KEEPS(s, STATE_FLIGHT)) path_sets_out(s, &here.at, &so_far, &with, PURPOSE_FLIGHT, mask_of(so_far.on_path), w);
    }
    mask on_path = mask_of(so_far.on_path);
    interaction found = interaction_kept(s, bounce);
    real far = way_to_interaction(&found, arrived);
    if (is_last) {
        const ray_hit last = queue_met(s.q, 0, s.slot);
        far = pick(mask_of(last.hit), last.t, (real)(REAL_LARGEST));
        on_path &= ~is_within_set(&with, w);
    }
    light_hit_of(arrived.origin, arrived.direction, bounce == 0, &far, w);
    halt before = {R(0.0), R(0.0), R(-1.0), R(0.0), R(0.0)};
    if (bounce > 0) STATE_RECALL(s, before, STATE_HALT);
    const mask past_last = less((real)((scalar)(w.settings->bounces - bounce)), before.turns);
    cloud_place cloud;
    cloud.met = on_path & ~on_path;
    if (HAS(w, CLOUDS)) cloud = path_meets_clouds(s, &here.at, &so_far, &far, before.passed, on_path, w);
    mask scatters = on_path & ~on_path;
    if (KEEPS(s, STATE_FLIGHT)) scatters = flight_ends(&so_far, &with, way_within(&with, far, w), on_path);
    cloud.met &= ~scatters;
    const mask over = (scatters | cloud.met) & past_last;
    so_far.on_path = pick(over, R(0.0), so_far.on_path);
    if (is_last) {
        STATE_KEEP(s, so_far, STATE_PATH);
        return;
    }
    scatters &= ~over;
    interaction_of_light(s, &found, arrived.origin, arrived.direction, with.flight, with.medium, scatters);
    halt stop = {pick(scatters, HALTED_BY_GLASS, R(0.0)), R(0.0), R(-1.0), R(0.0), before.turns};
    if (KEEPS(s, STATE_FLIGHT)) path_was_scattered(s, &here.at, &so_far, &with, scatters, w);
    if (HAS(w, CLOUDS)) {
        interaction_of_light(s, &found, arrived.origin, arrived.direction, cloud.t, cloud.number, cloud.met);
        cloud.met &= ~over;
        if (HAS(w, GLASS)) path_absorbs(&so_far, &with, far, cloud.met, w);
        path_in_cloud(&so_far, &cloud, cloud.met);
        stop.halted = pick(cloud.met, HALTED_BY_CLOUD, stop.halted);
        stop.anisotropy = cloud.anisotropy;
    }
    STATE_KEEP(s, so_far, STATE_PATH);
    path_state_keep(s, &with);
    STATE_KEEP(s, stop, STATE_HALT);
}
