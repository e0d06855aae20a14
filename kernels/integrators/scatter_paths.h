// Paths at their events: the stage SCATTER of a text that has said which costly parts its materials may have. A ray for light that is sought
// goes in the turn `next_turns`.
#include "integrators/path_stages.h"
#include "integrators/path_shares.h"

// Goes on from an event, over the boundary of a body if the direction leads there; where that is hidden a path goes on as it came.
INLINE void path_leaves(stage s, const packet_pixels *at, path *so_far, path_state *with, const event *e, const interaction *here, border edge,
                        const pbr *p, color weights, real place, mask lands, world w) {
    const path came = *so_far;
    const mask sinks = path_goes_on(s, at, so_far, with, e, w);
    if (!HAS(w, GLASS)) return;
    so_far->direction = vec_pick(edge.hidden, e->before, so_far->direction);
    so_far->through = color_pick(edge.hidden, came.through, so_far->through);
    so_far->on_path = pick(edge.hidden, came.on_path, so_far->on_path);
    path_crosses(so_far, with, here, edge, p, sinks, weights, place, lands, w);
}

// The light of the path's present event: what shines there, what one light brings, and where the path goes on.
CALLED void packet_scatters(stage s, const packet_pixels *at, int turn, world w) {
    const camera_sample a = camera_sample_kept(s);
    interaction found = interaction_kept(s, s.bounce);
    path so_far;
    const ray from_eye = eye_ray(&a, w.view), arrived = path_ray(s, from_eye, a.wanted, &so_far);
    path_state with;
    const halt stop = path_carries(s, &so_far, &with, arrived.origin, w);
    const mask halted = less(R(0.0), stop.halted);
    const real left_alone = pick(halted, so_far.on_path, R(0.0));
    const mask lands = path_arrives(s, &so_far, &with, &found, arrived, a.y, halted, w);
    // (Of a path that has had its last bounce in a cloud only what shines here is left to see, as at the end of any path.)
    const mask scatters = lands & less_equal(stop.turns, (real)((scalar)(w.settings->bounces - s.bounce)));
    const color white = color_of(R(1.0), R(1.0), R(1.0)), black = color_of(R(0.0), R(0.0), R(0.0));
    with.awaited = black;
    so_far.on_path = number_of(scatters);
    const mask emerges = path_comes_out(s.bounce, &with, &found, arrived.direction, lands, w), none = lands & ~lands;
    ray shadow_ray = {found.point, arrived.direction, R(0.0), R(-1.0), found.cone, R(0.0), RAY_NOTHING_KNOWN};
    sought seeks = {R(0.0), black, black};
    vec outward = found.normal, shading = outward;
    color reflects = white, weights = white;
    event e;
    pbr p;
    border edge = {.leaving = none, .glass = none, .hidden = none};
    real in_spectrum = R(0.0), unused;
    if (any_lane(lands)) {
        p = pbr_of_interaction(s, &found, w);
        if (HAS(w, GLASS)) {
            path_square(s, at, PURPOSE_WAVE, w, &in_spectrum, &unused);
            edge = border_at(&with, &found, lands, w);
            weights = glass_met(&with, &edge, &p, &in_spectrum, w);
            outward = vec_pick(edge.leaving, vec_scale(outward, R(-1.0)), outward);
        }
        p.emerges = number_of(emerges);
        color shines = color_scale(p.emission_color, p.emission_luminance);
        if (KEEPS(s, STATE_HALT)) shines = color_pick(scatters, shines, emitter_light(found.object, w));
        interaction_shines(s, &so_far, &with, &found, shines, lands & ~edge.hidden & ~emerges, w);
        if (KEEPS(s, STATE_AOVS)) reflects = pbr_albedo(&p, w.albedos);
        const vec to_viewer = vec_pick(emerges, found.normal, vec_scale(arrived.direction, R(-1.0)));
        e.surface = bsdf_of_interaction(s, &found, &p, edge.leaving, to_viewer, &shading, w);
    }
    if (any_lane(scatters)) {
        event_placed(&e, &found, shading, outward, w);
        e.before = arrived.direction;
        e.behind = edge.leaving;
        so_far.origin = vec_pick(scatters, e.from, so_far.origin);
        with.total = weight_of_all(e.from, e.own, w);
        const light_ray light = path_samples_light(s, at, &e, with.total, w, &with.awaited, &seeks.thing);
        with.awaited = color_mul(with.awaited, so_far.through);
        if (KEEPS(s, STATE_BENT)) with.awaited = color_pick(bent_answered(s, light.toward, &found, &seeks), black, with.awaited);
        if (HAS(w, SOUGHT)) light_is_sought(&with, &seeks, scatters & ~edge.hidden);
        if (s.bounce > 0 && !HAS(w, CLOUDS)) with.awaited = limited(with.awaited, w.settings);
        shadow_ray.origin = e.from;
        shadow_ray.direction = light.toward;
        shadow_ray.far = pick(scatters & ~edge.hidden & less_equal(seeks.thing, R(0.0)), light.distance, R(-1.0));
        shadow_ray.footprint = found.cone * (real)(w.settings->shadow_detail);
        if (HAS(w, GLASS)) awaited_absorbed(&with, &seeks, edge, light.distance, w);
        path_leaves(s, at, &so_far, &with, &e, &found, edge, &p, weights, in_spectrum, lands, w);
        path_widens(s, &so_far, &found, from_eye, a.time, lands, w);
    }
    if (KEEPS(s, STATE_FLIGHT)) {
        path_sets_out(s, at, &so_far, &with, PURPOSE_FLIGHT + NEXT_BOUNCE, scatters, w);
        walk_seeded(s, at, &with, lands, w);
    }
    if (KEEPS(s, STATE_HALT)) {
        const mask in_cloud = equal(stop.halted, HALTED_BY_CLOUD);
        const halt over = {pick(in_cloud, stop.halted, R(0.0)), stop.anisotropy, shadow_ray.far, R(0.0), stop.turns};
        STATE_KEEP(s, over, STATE_HALT);
        so_far.on_path += left_alone;
    }
    if (KEEPS(s, STATE_AOVS)) {
        if (s.bounce == 0) aovs_begin(s, lands, reflects, so_far.seen, shading);
        if (s.bounce == 1) aovs_once(s, so_far.seen);
    }
    with.awaited = color_pick(scatters & ~edge.hidden, with.awaited, black);
    STATE_KEEP(s, so_far, STATE_PATH);
    path_state_keep(s, &with);
    send_clipped(s, 0, shadow_ray, R(0.0), WHETHER, scatters & less(R(0.0), shadow_ray.far), w);
    if (HAS(w, SOUGHT)) sends_sought(s, turn, &seeks, shadow_ray, &so_far, w);
}

#define PACKET_SCATTERS(s, at, w) packet_scatters(s, at, next_turns, w)
STAGE(SCATTER) { FOR_PATHS(PACKET_SCATTERS); }
