// Entry point: interactions of what rays have met. It knows no formula.
#include "integrators/stages.h"
#include "integrators/interaction_found.h"
#include "shading/phase.h"
#include "shading/flights.h"
#include "shading/media.h"

// Makes interactions of what the rays along the path have met, and sends the rays that bring their light.
STAGE(find_interactions) {
    STAGE_BEGINS(s, w);
    if (HAS(w, PATHS) && paths_are_over(s)) return;
    const camera_sample a = camera_sample_kept(s);
    path so_far;
    const ray r = path_ray(s, eye_ray(&a, view), a.wanted, &so_far);
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    real object;
    vec place;
    ray_hit seen = surface_met(s, 0, r, &object, &place, w);
    if (HAS(w, GLASS_SET) && (bounce > 0 || w.settings->eye_body > 0)) seen = met_within(s, r, seen, &object, &place, w);
    counters_met(&cost, seen, 1);
    const sighting at_first = {seen.hit, seen.steps};
    interaction found = interaction_of_ray(r, seen, object, place, w);
    if (bounce > 0 && HAS(w, SUBSURFACE)) {
        const path_state with = path_state_kept(s);
        found.normal = vec_pick(path_emerges(bounce, &with, &found, w), vec_scale(found.normal, R(-1.0)), found.normal);
    }
    interaction_found(s, r, so_far.on_path, found, at_first, cost, next_turns, w);
}
