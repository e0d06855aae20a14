// Entry points: paths within clouds, and what comes through clouds to surfaces. They know no formula.
#include "integrators/path_stages.h"
#include "shading/plain_materials.h"
#include "shading/participating_media.h"
#include "geometry/clouds.h"
#include "integrators/path_shares.h"
#include "integrators/cloud_walk.h"

// Follows the paths that clouds have halted, each as long as nothing but clouds can be in its way: its lanes take path after path of a share.
STAGE(walk_clouds) {
    if (WAS_CANCELLED) return;
    const pass span_ = PASS;
    const queue queue_ = STAGE_QUEUE;
    const world w = WORLD;
#if LANES == 1
    if (IS_BEYOND) return;
    const stage s = stage_of(ITEM, ROW, span_, queue_, state, settings->state_at, first_tile, bounce, sample);
    if (!any_lane(cloud_halts(s))) return;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    cloud_walk a;
    walk_begins(&a, s, &here.at, ~0, w);
    while (a.live && !WAS_CANCELLED) walk_goes_on(&a, s, &here.at, w);
    walk_ends(&a, s, w);
#else
    stage s = stage_of(ITEM * (LANE_SHARE / LANES), ROW, span_, queue_, state, settings->state_at, first_tile, bounce, sample);
    const int begin = s.packet, beyond = min(begin + LANE_SHARE / LANES, end_packet);
    lane_list waiting;
    waiting.found = 0;
    for (int packet = begin; packet < beyond; ++packet) {
        lanes_listed(&waiting, lanes_bits(cloud_halts(stage_moved(s, packet - begin))), (packet - begin) * LANES);
    }
    if (waiting.found == 0) return;
    const int4 corner = s.span.places[s.tile];
    int numbers[LANES], of_tile[LANES];
    cloud_walk a = {0};
    a.live = less(R(1.0), R(0.0));
    uint fresh = ALL_LANES;
    s.q.lanes.apart = 1;
    for (int lane = 0; lane < LANES; ++lane) numbers[lane] = waiting.lanes[min(lane, waiting.found - 1)];
    waiting.taken = min(LANES, waiting.found);
    for (;;) {
        for (int lane = 0; lane < LANES; ++lane) of_tile[lane] = numbers[lane] + begin * LANES;
        const packet_pixels at = pixels_at(of_tile, (int2)(corner.x, corner.y));
#define PLACE_WALK(i) s.q.lanes.each.s##i = numbers[0x##i];
        EACH_LANE(PLACE_WALK)
        walk_begins(&a, s, &at, lanes_of_bits(fresh), w);
        uint idle;
        do {
            if (WAS_CANCELLED) return;
            walk_goes_on(&a, s, &at, w);
            idle = lanes_bits(~a.live);
        } while (idle != ALL_LANES && (bits_count(idle) < WALK_REFILL || waiting.taken >= waiting.found));
        walk_ends(&a, s, w);
        if (waiting.taken >= waiting.found) return;
        fresh = 0;
        for (int lane = 0; lane < LANES && waiting.taken < waiting.found; ++lane) {
            if (!(idle >> lane & 1u)) continue;
            numbers[lane] = waiting.lanes[waiting.taken++];
            fresh |= 1u << lane;
        }
    }
#endif
}

// What comes through clouds of the light that was sampled.
STAGE(pass_clouds) {
    PATH_STAGE_BEGINS(s, w);
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    path_state with = path_state_kept(s);
    STATE_KEPT(s, halt, stop, STATE_HALT);
    ray shadow_ray = queue_ray(s.q, 0, s.slot);
    shadow_ray.far = stop.far;
    with.awaited = color_scale(with.awaited, light_passes_clouds(s, &here.at, shadow_ray, less(R(0.0), stop.far), w));
    if (bounce > 0) with.awaited = limited(with.awaited, w.settings);
    path_state_keep(s, &with);
}
