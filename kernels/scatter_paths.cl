// Entry point: paths at their spots. It knows no formula.
#include "path_stages.h"

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
