// Entry point: spots of what rays have met. It knows no formula.
#include "stages.h"
#include "environment.h"
#include "phase.h"
#include "spot.h"
#include "light_places.h"
#include "secondary.h"
#include "fog.h"
#include "air.h"
#if HAS_SUBSURFACE
#include "media.h"
#endif

// Makes spots of what the rays along the path have met, and sends the rays that bring their light.
STAGE(find_spots) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    if (HAS(w, PATHS) && paths_are_over(s)) return;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const aim a = aim_kept(s);
    path so_far;
    const ray r = path_ray(s, eye_ray(&a, view), a.wanted, &so_far);
    tally cost;
    STATE_RECALL(s, cost, STATE_TALLY);
    sighting at_first = {R(0.0), R(0.0)};
    spot found;
    if (bounce == 0 && settings->point_count > 1) {
        found = spot_kept(s, 0);
        STATE_RECALL(s, at_first, STATE_SIGHTING);
    } else {
        real object;
        vec place;
        encounter met = surface_met(s, 0, r, &object, &place, w);
#if HAS_GLASS_SET
        if (bounce > 0) met = met_within(s, r, met, &object, &place, w);
#endif
        tally_met(&cost, met, 1);
        at_first.coverage = met.hit;
        at_first.steps = met.steps;
        found = spot_of_ray(r, met, object, place, w);
    }
    if (KEEPS(s, STATE_FACE)) at_first.coverage = pick(spot_on_face(s, r, &found, w), R(1.0), at_first.coverage);
    if (bounce == 0) STATE_KEEP(s, at_first, STATE_SIGHTING);
    STATE_KEEP(s, cost, STATE_TALLY);
    found.found = pick(mask_of(so_far.on_path), found.found, R(0.0));
#if HAS_SUBSURFACE
    if (bounce > 0) {
        carried with;
        with = carried_kept(s);
        found.normal = vec_pick(path_emerges(bounce, &with, &found, w), vec_scale(found.normal, R(-1.0)), found.normal);
    }
#endif
    if (w.material->coloring == COLORING_RESIDUAL) found.quantity = found.residual;
    spot_keep(s, &found, bounce);
    send_for_light(s, &here.at, &found, next_turns, w);
    if (bounce == 0 && KEEPS(s, STATE_AIR)) air_send(s, &here.at, a, &found, HAS(w, PATHS) ? 1 : next_turns, w);
}
