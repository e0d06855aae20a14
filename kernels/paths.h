// The stages of paths, see `path_steps.h`.
#include "path_steps.h"

// The light of the path's present spot: what shines there, what one light brings, and where the path goes on.
STAGE(scatter_paths) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    if (paths_are_over(s)) return;
    const world w = WORLD;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const aim a = aim_kept(s);
    spot found = spot_kept(s, bounce);
    path so_far;
    const ray from_eye = eye_ray(&a, view), arrived = path_ray(s, from_eye, a.wanted, &so_far);
    carried with = path_carries(s, &here.at, &so_far, arrived.origin, w);
    scatterer by;
    const mask lands = path_arrives(s, &here.at, &so_far, &with, &found, arrived, a.y, &by, w);
    mask asking = lands;
    const path flown = so_far;
    const carried within = with;
    with.awaited = color_of(R(0.0), R(0.0), R(0.0));
    so_far.on_path = number_of(lands);
    const mask emerges = path_comes_out(bounce, &with, &found, arrived.direction, lands, w);
    ray asks = {found.point, arrived.direction, R(0.0), R(-1.0), found.cone, R(0.0), RAY_NOTHING_KNOWN};
    vec outward = found.normal, shading = outward;
    color reflects = color_of(R(1.0), R(1.0), R(1.0));
    if (any_lane(lands)) {
        if (!is_colored_at_once(w.material)) found.tint = tint_of(&found, w);
        pbr p = pbr_of_spot(s, &found, w);
        mask behind = lands & ~lands, shows = lands;
#if HAS_GLASS
        real wave, unused;
        path_square(s, &here.at, PURPOSE_WAVE, w, &wave, &unused);
        const border edge = border_at(&with, &found, w);
        const color weights = glass_met(&with, edge, &p, &wave, w);
        behind = edge.leaving;
        shows &= ~edge.hidden;
        outward = vec_pick(behind, vec_scale(outward, R(-1.0)), outward);
#endif
        p.emerges = number_of(emerges);
        spot_shines(s, &so_far, &with, &found, color_scale(p.emission_color, p.emission_luminance), shows & ~emerges, w);
        if (KEEPS(s, STATE_GLANCE)) reflects = pbr_albedo(&p, w.albedos);
        const bsdf b = bsdf_of_spot(s, &found, &p, behind, vec_pick(emerges, found.normal, vec_scale(arrived.direction, R(-1.0))), &shading, w);
        so_far.origin = vec_along(found.point, lift_of(&found, w), outward);
        with.total = weight_of_all(so_far.origin, found.object, w);
        const light_ray light = path_asks(s, &here.at, found.point, so_far.origin, found.object, &b, with.total, behind, w, &with.awaited);
        with.awaited = color_mul(with.awaited, so_far.through);
#if HAS_CLOUDS
        with.awaited = color_scale(with.awaited, light_passes_clouds(s, &here.at, so_far.origin, light.toward, light.distance, shows, w));
#endif
        if (bounce > 0) with.awaited = limited(with.awaited, w.settings);
        asks.origin = so_far.origin;
        asks.direction = light.toward;
        asks.far = pick(shows, light.distance, R(-1.0));
        asks.footprint = found.cone * (real)(w.settings->shadow_detail);
#if HAS_GLASS
        awaited_absorbed(&with, edge, light.distance, w);
        const path before_it = so_far;
#endif
        const mask sinks = path_goes_on(s, &here.at, &so_far, &with, &b, w);
#if HAS_GLASS
        path_goes_straight(&so_far, &before_it, arrived.direction, edge.hidden);
        path_crosses(&so_far, &with, &found, edge, &p, sinks, weights, wave, w);
#endif
        path_widens(s, &so_far, &found, from_eye, a.time, w);
    }
#if HAS_GLASS_SCATTER
    path_sets_out(s, &here.at, &so_far, &with, PURPOSE_FLIGHT + NEXT_BOUNCE, lands, w);
    walk_seeded(s, &here.at, &with, w);
    path_was_scattered(s, &here.at, &so_far, &with, flown, within, arrived, by.glass, w);
#endif
#if HAS_CLOUDS
    path_in_cloud(s, &here.at, &so_far, &with, flown, within, arrived, &by.cloud, &asks, by.cloud.met, w);
    asking |= by.cloud.met;
#endif
    if (KEEPS(s, STATE_GLANCE)) {
        if (bounce == 0) glance_begin(s, lands, reflects, so_far.seen, shading);
        if (bounce == 1) glance_once(s, so_far.seen);
    }
    with.awaited = color_pick(asking, with.awaited, color_of(R(0.0), R(0.0), R(0.0)));
    STATE_KEEP(s, so_far, STATE_PATH);
    carried_keep(s, &with);
    send_clipped(s, 0, asks, R(0.0), WHETHER, asking & less(R(0.0), asks.far), w);
}

// Adds the light that was asked for, where nothing is in its way, and sends the next ray of the path.
STAGE(gather_paths) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    if (paths_are_over(s)) return;
    const world w = WORLD;
    path so_far;
    carried with;
    STATE_RECALL(s, so_far, STATE_PATH);
    with = carried_kept(s);
    tally cost;
    STATE_RECALL(s, cost, STATE_TALLY);
    const encounter answer = queue_met(s.q, 0, s.slot);
    tally_met(&cost, answer, 0);
    so_far.seen = color_pick(mask_of(answer.hit), so_far.seen, color_add(so_far.seen, with.awaited));
    if (bounce == 0 && KEEPS(s, STATE_AIR)) {
        const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
        const spot found = spot_kept(s, 0);
        air_gather(s, &here.at, aim_kept(s), &found, 1, &cost, w);
    }
    STATE_KEEP(s, cost, STATE_TALLY);
    STATE_KEEP(s, so_far, STATE_PATH);
    real far = (real)(REAL_LARGEST);
#if HAS_GLASS_SCATTER && HAS_OBJECTS
    far = pick(equal(body_of(with.medium), set_body(w)), far, flight_sought(&so_far, &with, w));
#endif
    const ray r = {so_far.origin, so_far.direction, R(0.0), far, so_far.footprint, so_far.spread, RAY_NOTHING_KNOWN};
#if HAS_GLASS_SET
    const mask within = equal(body_of(with.medium), set_body(w));
    send_clipped(s, 1, r, R(0.0), WHICH, mask_of(so_far.on_path) & within, w);
    so_far.on_path = pick(within, R(0.0), so_far.on_path);
#endif
    send_clipped(s, 0, r, R(0.0), WHICH, mask_of(so_far.on_path), w);
}

// Ends the shots. The last ray of a path only finds out whether it leaves the set: else light that both ways could have found would
// have a part of its weight.
STAGE(end_paths) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const aim a = aim_kept(s);
    path so_far;
    carried with;
    tally cost;
    STATE_RECALL(s, so_far, STATE_PATH);
    with = carried_kept(s);
    STATE_RECALL(s, cost, STATE_TALLY);
    const encounter last = queue_met(s.q, 0, s.slot);
    tally_met(&cost, last, 0);
    mask on_path = mask_of(so_far.on_path);
#if HAS_GLASS_SET
    on_path &= ~equal(body_of(with.medium), set_body(w));
#endif
    real far = pick(mask_of(last.hit), last.t, (real)(REAL_LARGEST));
    lamp before = lamp_met(so_far.origin, so_far.direction, 0, &far, w);
    before.met &= on_path;
#if HAS_CLOUDS
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const cloud_place cloud = path_meets_clouds(s, &here.at, &so_far, so_far.origin, so_far.direction, &far, on_path, w);
#endif
#if HAS_GLASS
    const mask scatters = path_crosses_medium(&so_far, &with, far, on_path, w);
    on_path &= ~scatters;
    before.met &= ~scatters;
#endif
#if HAS_CLOUDS
    on_path &= ~cloud.met;
    before.met &= ~cloud.met;
#endif
    path_ends(&so_far, &with, &before, on_path & ~mask_of(last.hit), a.y, w);
#if HAS_EMITTERS
    path_ends_at_emitter(s, &so_far, &with, last, on_path & ~before.met, w);
#endif
    if (bounce == 1 && KEEPS(s, STATE_GLANCE)) glance_once(s, so_far.seen);
    const spot first_spot = spot_kept(s, 0);
    end_shots(s, a, so_far.seen, &first_spot, cost, w);
}
