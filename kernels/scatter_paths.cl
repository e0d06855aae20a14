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
    carried with;
    const mask halted = path_carries(s, &so_far, &with, arrived.origin, w);
    const mask lands = path_arrives(s, &so_far, &with, &found, arrived, a.y, halted, w);
    with.awaited = color_of(R(0.0), R(0.0), R(0.0));
    so_far.on_path = number_of(lands);
    const mask emerges = path_comes_out(bounce, &with, &found, arrived.direction, lands, w);
    ray asks = {found.point, arrived.direction, R(0.0), R(-1.0), found.cone, R(0.0), RAY_NOTHING_KNOWN};
    vec outward = found.normal, shading = outward;
    color reflects = color_of(R(1.0), R(1.0), R(1.0));
    if (any_lane(lands)) {
        pbr p = pbr_of_spot(s, &found, w);
        const mask none = lands & ~lands;
        border edge = {R(0.0), none, none, R(0.0)};
        color weights = reflects;
        real wave = R(0.0), unused;
        if (HAS(w, GLASS)) {
            path_square(s, &here.at, PURPOSE_WAVE, w, &wave, &unused);
            edge = border_at(&with, &found, w);
            weights = glass_met(&with, edge, &p, &wave, w);
            outward = vec_pick(edge.leaving, vec_scale(outward, R(-1.0)), outward);
        }
        const mask behind = edge.leaving, shows = lands & ~edge.hidden;
        p.emerges = number_of(emerges);
        spot_shines(s, &so_far, &with, &found, color_scale(p.emission_color, p.emission_luminance), shows & ~emerges, w);
        if (KEEPS(s, STATE_GLANCE)) reflects = pbr_albedo(&p, w.albedos);
        const bsdf b = bsdf_of_spot(s, &found, &p, behind, vec_pick(emerges, found.normal, vec_scale(arrived.direction, R(-1.0))), &shading, w);
        so_far.origin = vec_along(found.point, lift_of(&found, w), outward);
        with.total = weight_of_all(so_far.origin, found.object, w);
        const light_ray light = path_asks(s, &here.at, found.point, so_far.origin, found.object, &b, with.total, behind, w, &with.awaited);
        with.awaited = color_mul(with.awaited, so_far.through);
        if (bounce > 0 && !HAS(w, CLOUDS)) with.awaited = limited(with.awaited, w.settings);
        asks.origin = so_far.origin;
        asks.direction = light.toward;
        asks.far = pick(shows, light.distance, R(-1.0));
        asks.footprint = found.cone * (real)(w.settings->shadow_detail);
        if (HAS(w, GLASS)) awaited_absorbed(&with, edge, light.distance, w);
        const color through = so_far.through;
        const real on_path = so_far.on_path;
        const mask sinks = path_goes_on(s, &here.at, &so_far, &with, &b, w);
        if (HAS(w, GLASS)) {
            // Over a boundary that is hidden a path goes on as it came.
            so_far.direction = vec_pick(edge.hidden, arrived.direction, so_far.direction);
            so_far.through = color_pick(edge.hidden, through, so_far.through);
            so_far.on_path = pick(edge.hidden, on_path, so_far.on_path);
            path_crosses(&so_far, &with, &found, edge, &p, sinks, weights, wave, w);
        }
        path_widens(s, &so_far, &found, from_eye, a.time, w);
    }
    if (KEEPS(s, STATE_FLIGHT)) {
        path_sets_out(s, &here.at, &so_far, &with, PURPOSE_FLIGHT + NEXT_BOUNCE, lands, w);
        walk_seeded(s, &here.at, &with, w);
    }
    if (KEEPS(s, STATE_HALT)) path_halts(s, &so_far, &with, &asks, halted, w);
    if (KEEPS(s, STATE_GLANCE)) {
        if (bounce == 0) glance_begin(s, lands, reflects, so_far.seen, shading);
        if (bounce == 1) glance_once(s, so_far.seen);
    }
    const mask asking = lands | halted;
    with.awaited = color_pick(asking, with.awaited, color_of(R(0.0), R(0.0), R(0.0)));
    STATE_KEEP(s, so_far, STATE_PATH);
    carried_keep(s, &with);
    send_clipped(s, 0, asks, R(0.0), WHETHER, asking & less(R(0.0), asks.far), w);
}
