// Entry points: the points of a pixel, where it has several. They know no formula.
#include "integrators/stages.h"
#include "integrators/march/normals.h"
#include "integrators/interaction_found.h"
#include "integrators/march/pixel_points.h"

// Sends the rays of a pixel's points, from where its cone touched.
STAGE(send_points) {
    STAGE_BEGINS(s, w);
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const camera_sample a = camera_sample_kept(s);
    queue of_set = s.q;
    of_set.objects = 0;
    const ray_hit end_of_cone = queue_met(of_set, 0, s.slot);
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    counters_met(&cost, end_of_cone, 0);
    cost.bad += end_of_cone.bad;
    const touch touched = {end_of_cone.hit, end_of_cone.t};
    STATE_KEEP(s, cost, STATE_COUNTERS);
    STATE_KEEP(s, touched, STATE_TOUCH);
    if (points_may_meet(s, touched)) points_send(s, a, touched, eye_ray(&a, view), points_seed(&here.at, sample, w), w);
    else points_skip(s, w);
}

// Makes interactions of what a pixel's points have met, in the place of `find_interactions`.
STAGE(join_points) {
    STAGE_BEGINS(s, w);
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const camera_sample a = camera_sample_kept(s);
    STATE_KEPT(s, counters, cost, STATE_COUNTERS);
    STATE_KEPT(s, touch, touched, STATE_TOUCH);
    sighting at_first = {R(0.0), cost.steps};
    const ray r = eye_ray(&a, view);
    pixel_points points = points_begin(r, a.time, touched, points_seed(&here.at, sample, w), w);
    const int added = points_may_meet(s, touched) ? settings->point_count : points_none(s, r, w);
    for (int turn = 0; turn < added; ++turn) {
        const ray each = queue_ray(s.q, turn, s.slot);
        real object;
        vec place;
        const ray_hit met = surface_met(s, turn, each, &object, &place, w);
        counters_met(&cost, met, 1);
        at_first.steps += met.steps;
        points_add(s, &points, turn, each, met, object, place, w);
    }
    at_first.coverage = points.count * (R(1.0) / (real)((scalar)settings->point_count));
    interaction_found(s, r, a.wanted, points_interaction(s, &points, w), at_first, cost, next_turns, w);
}
