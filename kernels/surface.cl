// Entry points of the surface renderer that know no formula: the stages between marches. Compiled once for each set of features.
#include "lanes.h"
#include "numbers/real.h"
#include "vectors.h"
#include "structs.h"
#include "camera.h"
#include "sampling.h"
#include "shade.h"
#include "tiles.h"
#include "pixel.h"
#include "normals.h"
#include "environment.h"
#include "planes.h"
#include "stage.h"
#include "state.h"
#include "eye.h"
#include "cones.h"
#include "sky.h"
#include "phase.h"
#include "spot.h"
#include "pixel_points.h"
#include "light_places.h"
#include "secondary.h"
#include "fog.h"
#include "air.h"
#include "look.h"
#include "lit.h"
#include "shots.h"
#if HAS_PATHS
#include "bsdf.h"
#include "bsdf_bumped.h"
#include "material_at.h"
#include "lights.h"
#if HAS_GLASS
#include "glass_paths.h"
#endif
#include "light_asks.h"
#include "paths.h"
#endif

// Sends the cones of blocks: a packet of lanes for a packet of blocks, of which the wave has `wave`.
STAGE(send_cones) {
    const pass span = PASS;
    const queue q = STAGE_QUEUE;
    const world w = WORLD;
    if (ITEM * LANES < wave && !WAS_CANCELLED) cones_send(span, q, ITEM * LANES, first_tile, w);
}

// Sends the rays from the eye. With several points to the pixel the ray only finds out how far the pixel's whole cone is free.
STAGE(begin_shots) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const pixel p = sums_before(s, &here);
    const aim a = aim_of(s, &here, sample_wanted(s.span, &here.at, &p, sample));
    STATE_KEEP(s, a, STATE_AIM);
    if (sample == first) count_waits_from(s.span, &here);
    tally cost = {R(0.0), R(0.0), R(0.0)};
    start_of_rays begin = {R(0.0)};
    if (turns > 0 && sample == first) {
        begin.t = cone_end(s, &here, s.tile - first_tile, &cost);
        STATE_KEEP(s, begin, STATE_START);
    } else if (turns > 0) {
        STATE_RECALL(s, begin, STATE_START);
    }
    STATE_KEEP(s, cost, STATE_TALLY);
    ray r = eye_ray(&a, view);
    r.footprint *= (real)(w.settings->touch_share);
    r.spread *= (real)(w.settings->touch_share);
#if HAS_OBJECTS
    // A pixel's points look for objects on their own rays.
    if (settings->point_count > 1) {
        send_past_objects(s, 0, r, begin.t, mask_of(a.wanted), w);
        return;
    }
#endif
    send_clipped(s, 0, r, begin.t, WHICH, mask_of(a.wanted), w);
}

// Sends the rays of a pixel's points, from where its cone touched.
STAGE(send_points) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const aim a = aim_kept(s);
    const encounter end_of_cone = queue_met(s.q, 0, s.slot);
    tally cost;
    STATE_RECALL(s, cost, STATE_TALLY);
    tally_met(&cost, end_of_cone, 0);
    cost.bad += end_of_cone.bad;
    const touch touched = {end_of_cone.hit, end_of_cone.t};
    STATE_KEEP(s, cost, STATE_TALLY);
    STATE_KEEP(s, touched, STATE_TOUCH);
    points_send(s, a, touched, eye_ray(&a, view), points_seed(&here.at, sample, w), w);
}

// Makes spots of what a pixel's points have met.
STAGE(join_points) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const aim a = aim_kept(s);
    tally cost;
    touch touched;
    STATE_RECALL(s, cost, STATE_TALLY);
    STATE_RECALL(s, touched, STATE_TOUCH);
    sighting at_first = {R(0.0), cost.steps};
    pixel_points points = points_begin(eye_ray(&a, view), a.time, touched, points_seed(&here.at, sample, w), w);
    for (int turn = 0; turn < settings->point_count; ++turn) {
        const ray r = queue_ray(s.q, turn, s.slot);
        real object;
        vec place;
        const encounter met = surface_met(s, turn, r, &object, &place, w);
        tally_met(&cost, met, 1);
        at_first.steps += met.steps;
        points_add(s, &points, turn, r, met, object, place, w);
    }
    at_first.coverage = points.count * (R(1.0) / (real)((scalar)settings->point_count));
    const spot found = points_spot(s, &points, w);
    STATE_KEEP(s, cost, STATE_TALLY);
    STATE_KEEP(s, at_first, STATE_SIGHTING);
    spot_keep(s, &found, 0);
}

// Makes spots of what the rays along the path have met, and sends the rays that bring their light.
STAGE(find_spots) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
#if HAS_PATHS
    if (paths_are_over(s)) return;
#endif
    const world w = WORLD;
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
#if HAS_FACES
    at_first.coverage = pick(spot_on_face(s, r, &found, w), R(1.0), at_first.coverage);
#endif
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
    if (bounce == 0 && KEEPS(s, STATE_AIR)) air_send(s, &here.at, a, &found, HAS_PATHS ? 1 : next_turns, w);
}

#if !HAS_PATHS
// Gathers the light of the spots. Where the path ends here, its shot ends too; else its mirrored ray is sent.
STAGE(light_spots) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const aim a = aim_kept(s);
    spot found = spot_kept(s, bounce);
    tally cost;
    STATE_RECALL(s, cost, STATE_TALLY);
    path so_far;
    const ray arrived = path_ray(s, eye_ray(&a, view), a.wanted, &so_far);
    const vec direction = arrived.direction;
    if (bounce == 0 && KEEPS(s, STATE_AIR)) {
        const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
        air_gather(s, &here.at, a, &found, turns_for_light(w), &cost, w);
    }
    path_meets_light(s, &so_far, &found, arrived, w);
    color gathered = color_of(R(0.0), R(0.0), R(0.0));
    if (any_lane(mask_of(found.found))) {
        if (!is_colored_at_once(w.material)) found.tint = tint_of(&found, w);
        gathered = light_gathered(s, &found, vec_scale(direction, R(-1.0)), &cost, w);
        gathered = color_pick(on_face(&found), found.tint, gathered);
    }
    if (bounce == 0 && KEEPS(s, STATE_GLANCE)) {
        glance_begin(s, mask_of(so_far.on_path) & mask_of(found.found), found.tint, color_of(R(0.0), R(0.0), R(0.0)), found.normal);
    }
    const int last = bounce == settings->bounces;
    const color mirrored = color_pick(on_face(&found), color_of(R(0.0), R(0.0), R(0.0)), mirrored_at(&found, direction, w));
    path_add(s, &so_far, direction, a.y, &found, gathered, mirrored, last, w);
    if (!last) {
        STATE_KEEP(s, cost, STATE_TALLY);
        path_mirror(s, &so_far, direction, eye_ray(&a, view), a.time, &found, mirrored, w);
        return;
    }
    end_shots(s, a, so_far.seen, &found, cost, w);
}
#endif
