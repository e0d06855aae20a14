// Paths of light: at each spot one light is asked for directly, and one direction is followed (Kajiya 1986). What both could have
// found is weighed by the power heuristic (Veach and Guibas 1995), so neither small lights nor sharp highlights are noise.
#include "path_ends.h"

INLINE void path_square(stage s, const packet_pixels *at, uint purpose, world w, real *u, real *v) {
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed, purpose + 16u * (uint)s.bounce);
    unit_square((bits)((uint)s.sample), seed, u, v);
}

// One of all lights: a ray towards it, and what the ray brings to the eye if nothing is in its way.
// `behind`: in glass, whether the spot is seen from inside its body.
INLINE light_ray path_asks(stage s, const packet_pixels *at, vec point, vec from, real own, const bsdf *b, real total, mask behind, world w, color *brings) {
    real u, v, choice, unused;
    path_square(s, at, PURPOSE_ASK, w, &u, &v);
    path_square(s, at, PURPOSE_CHOICE, w, &choice, &unused);
    real numbers[ASKING_NUMBERS] = {u, v, choice, R(0.5), R(0.5)};
#if HAS_SET_LIGHTS
    path_square(s, at, PURPOSE_SET_LIGHT, w, numbers + 3, numbers + 4);
#endif
    const asked a = light_asked(point, from, b->normal, own, numbers, total, w);
    light_ray chosen = a.ray;
    real density;
    color scattered;
    scatter_value(b, &chosen.toward, w.albedos, &scattered, &density);
    *brings = color_scale(color_mul(scattered, chosen.light), asked_weight(&a, density));
    mask dark = ~less(R(0.0), brightest(*brings));
#if HAS_GLASS
    // A body hides what is behind its surface.
    dark |= ~leads_out(chosen.toward, SURFACE_NORMAL(b), behind);
#endif
    *brings = color_pick(dark, color_of(R(0.0), R(0.0), R(0.0)), *brings);
    // What nothing can block needs no march.
    chosen.distance = pick(~a.unblocked & ~dark, chosen.distance, R(-1.0));
    return chosen;
}

// Goes on in a direction that the surface chooses, unless Russian roulette ends the path (Arvo and Kirk 1990).
INLINE void path_goes_on(stage s, const packet_pixels *at, path *so_far, carried *with, const bsdf *b, world w) {
    real u, v, choice, roulette;
    path_square(s, at, PURPOSE_SCATTER, w, &u, &v);
    path_square(s, at, PURPOSE_CHOICES, w, &choice, &roulette);
#if HAS_BUMP
    real wall, unused;
    color value;
    path_square(s, at, PURPOSE_WALL, w, &wall, &unused);
    so_far->direction = scatter_sample(b, choice, u, v, wall);
    scatter_value(b, &so_far->direction, w.albedos, &value, &with->density);
#else
    so_far->direction = bsdf_sample(b, choice, u, v, &with->density);
    const color value = bsdf_value(b, so_far->direction, w.albedos);
#endif
    mask on_path = mask_of(so_far->on_path) & less(R(0.0), with->density);
    const color part = color_scale(value, R(1.0) / with->density);
    so_far->through = color_pick(on_path, color_mul(so_far->through, part), so_far->through);
    on_path &= less(R(0.0), brightest(so_far->through));
    if (s.bounce >= w.settings->roulette) {
        const real stays = fmin(brightest(so_far->through), R(0.95));
        on_path &= less(roulette, stays);
        so_far->through = color_pick(on_path, color_scale(so_far->through, R(1.0) / stays), so_far->through);
    }
    so_far->on_path = number_of(on_path);
}

// A spot's material, ready to scatter by the normal `shading`, which is the surface's own, or that of its relief. `behind`: in glass,
// whether the spot is seen from inside its body.
INLINE bsdf bsdf_of_spot(stage s, const spot *here, const pbr *p, mask behind, vec to_viewer, vec *shading, world w) {
#if HAS_BUMP
    bumped_normal(s, here, &behind, &to_viewer, shading, w);
    bsdf b = bsdf_at(p, *shading, to_viewer, w.albedos);
    bsdf_lean(&b, here->normal);
    return b;
#else
    return bsdf_at(p, *shading, to_viewer, w.albedos);
#endif
}

// Brings a path along its ray to what it has met, and says whether that is a spot: else it is a lamp, or all past the set.
INLINE mask path_arrives(stage s, path *so_far, const carried *with, spot *found, ray arrived, real picture_y, world w) {
    const mask on_path = mask_of(so_far->on_path);
    real far = pick(mask_of(found->found), vec_dot(vec_sub(found->seen, arrived.origin), arrived.direction), (real)(REAL_LARGEST));
    lamp before = lamp_met(arrived.origin, arrived.direction, s.bounce == 0, &far, w);
    before.met &= on_path;
    const mask lands = on_path & mask_of(found->found) & ~before.met;
#if HAS_GLASS
    path_absorbs(so_far, with, far, w);
#endif
    if (s.bounce > 0) {
        path_ends(so_far, with, &before, on_path & ~lands, picture_y, w);
    } else {
        so_far->seen = color_pick(before.met, color_mul(before.shows, so_far->through), so_far->seen);
        spot_of_light(s, found, arrived.origin, arrived.direction, far, before.met);
    }
    return lands;
}

// The light of the path's present spot: what shines there, what one light brings, and where the path goes on.
STAGE(scatter_paths) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
    const aim a = aim_kept(s.state, s.stride);
    spot found = spot_kept(s.state, bounce, s.stride);
    path so_far;
    const ray from_eye = eye_ray(&a, view), arrived = path_ray(s, from_eye, a.wanted, &so_far);
    carried with = {color_of(R(0.0), R(0.0), R(0.0)), R(-1.0), R(1.0)};
#if HAS_GLASS
    if (bounce == 0) media_begin(&with, arrived.origin, w);
#endif
    if (bounce > 0) STATE_RECALL(s, with, STATE_CARRIED);
    const mask lands = path_arrives(s, &so_far, &with, &found, arrived, a.y, w);
    with.awaited = color_of(R(0.0), R(0.0), R(0.0));
    so_far.on_path = number_of(lands);
    ray asks = {found.point, arrived.direction, R(0.0), R(-1.0), found.cone, R(0.0), RAY_NOTHING_KNOWN};
    vec outward = found.normal, shading = outward;
#if HAS_PARTS
    color reflects = color_of(R(1.0), R(1.0), R(1.0));
#endif
    if (any_lane(lands)) {
#if !COLORING_PER_POINT
        found.tint = spot_color(found.normal, found.quantity, OBJECT_OF(found), w);
#endif
        pbr p = pbr_at(s, &found, w);
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
        spot_shines(s, &so_far, &with, &found, color_scale(p.emission_color, p.emission_luminance), shows, w);
#if HAS_PARTS
        reflects = pbr_albedo(&p, w.albedos);
#endif
        const bsdf b = bsdf_of_spot(s, &found, &p, behind, vec_scale(arrived.direction, R(-1.0)), &shading, w);
        so_far.origin = vec_along(found.point, lift_of(&found, w), outward);
        with.total = weight_of_all(so_far.origin, OBJECT_OF(found), w);
        const light_ray light = path_asks(s, &here.at, found.point, so_far.origin, OBJECT_OF(found), &b, with.total, behind, w, &with.awaited);
        with.awaited = color_mul(with.awaited, so_far.through);
        if (bounce > 0) with.awaited = limited(with.awaited, w.settings);
        asks.origin = so_far.origin;
        asks.direction = light.toward;
        asks.far = pick(shows, light.distance, R(-1.0));
        asks.footprint = found.cone * (real)(w.settings->shadow_detail);
#if HAS_GLASS
        awaited_absorbed(&with, edge, light.distance, w);
        const path before_it = so_far;
#endif
        path_goes_on(s, &here.at, &so_far, &with, &b, w);
#if HAS_GLASS
        path_goes_straight(&so_far, &before_it, arrived.direction, edge.hidden);
        path_crosses(&so_far, &with, &found, edge, &p, weights, wave, w);
#endif
        spot seen_first = found;
        if (bounce > 0) seen_first = spot_kept(s.state, 0, s.stride);
        so_far.footprint = found.cone;
        so_far.spread = from_eye.spread + from_eye.footprint / fmax(depth_of(seen_first.seen, a.time, w.view), found.cone);
    }
#if HAS_PARTS
    if (bounce == 0) glance_begin(s, lands, reflects, so_far.seen, shading);
    if (bounce == 1) glance_once(s, so_far.seen);
#endif
    with.awaited = color_pick(lands, with.awaited, color_of(R(0.0), R(0.0), R(0.0)));
    STATE_KEEP(s, so_far, STATE_PATH);
    STATE_KEEP(s, with, STATE_CARRIED);
    send_clipped(s, 0, asks, R(0.0), WHETHER, lands & less(R(0.0), asks.far), w);
}

// Adds the light that was asked for, where nothing is in its way, and sends the next ray of the path.
STAGE(gather_paths) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    path so_far;
    carried with;
    STATE_RECALL(s, so_far, STATE_PATH);
    STATE_RECALL(s, with, STATE_CARRIED);
    tally cost;
    STATE_RECALL(s, cost, STATE_TALLY);
    const encounter answer = queue_met(s.q, 0, s.slot);
    tally_met(&cost, answer, 0);
    so_far.seen = color_pick(mask_of(answer.hit), so_far.seen, color_add(so_far.seen, with.awaited));
#if HAS_SHAFTS
    if (bounce == 0) {
        const place_in_pass here = place_of_packet(s.span, s.packet, s.tile);
        const spot found = spot_kept(s.state, 0, s.stride);
        air_gather(s, &here.at, aim_kept(s.state, s.stride), &found, 1, &cost, w);
    }
#endif
    STATE_KEEP(s, cost, STATE_TALLY);
    STATE_KEEP(s, so_far, STATE_PATH);
    const ray r = {so_far.origin, so_far.direction, R(0.0), (real)(REAL_LARGEST), so_far.footprint, so_far.spread, RAY_NOTHING_KNOWN};
#if HAS_GLASS_SET
    const mask within = equal(with.medium, set_body(w));
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
    const aim a = aim_kept(s.state, s.stride);
    path so_far;
    carried with;
    tally cost;
    STATE_RECALL(s, so_far, STATE_PATH);
    STATE_RECALL(s, with, STATE_CARRIED);
    STATE_RECALL(s, cost, STATE_TALLY);
    const encounter last = queue_met(s.q, 0, s.slot);
    tally_met(&cost, last, 0);
    mask on_path = mask_of(so_far.on_path);
#if HAS_GLASS_SET
    on_path &= ~equal(with.medium, set_body(w));
#endif
    real far = pick(mask_of(last.hit), last.t, (real)(REAL_LARGEST));
    lamp before = lamp_met(so_far.origin, so_far.direction, 0, &far, w);
    before.met &= on_path;
#if HAS_GLASS
    path_absorbs(&so_far, &with, far, w);
#endif
    path_ends(&so_far, &with, &before, on_path & ~mask_of(last.hit), a.y, w);
#if HAS_EMITTERS
    path_ends_at_emitter(s, &so_far, &with, last, on_path & ~before.met, w);
#endif
#if HAS_PARTS
    if (bounce == 1) glance_once(s, so_far.seen);
#endif
    const spot first_spot = spot_kept(s.state, 0, s.stride);
    end_shots(s, a, so_far.seen, &first_spot, cost, w);
}
