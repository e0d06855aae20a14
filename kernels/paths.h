// Paths of light: at each spot one light is asked for directly, and one direction is followed (Kajiya 1986). What both could have
// found is weighed by the power heuristic (Veach and Guibas 1995), so neither small lights nor sharp highlights are noise.

INLINE real power_share(real own, real other) {
    const real square = own * own;
    return square / fmax(square + other * other, (real)(REAL_SMALLEST));
}

INLINE void path_square(stage s, const packet_pixels *at, uint purpose, world w, real *u, real *v) {
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed, purpose + 16u * (uint)s.bounce);
    unit_square((bits)((uint)s.sample), seed, u, v);
}

// What could light a point from everywhere: the sum over the lights, and the environment.
INLINE real weight_of_all(vec point, world w) {
    real sum = (real)(w.settings->environment_weight);
    for (int i = 0; i < w.settings->light_count; ++i) sum += light_weight(w.lights + i, point);
    return fmax(sum, (real)(REAL_SMALLEST));
}

// What a ray that meets nothing brings, for a path that has chosen its direction with `density` where all lights weigh `total`.
// A negative density: nothing else could have found it.
INLINE color light_past(vec direction, real picture_y, vec from, real density, real total, world w) {
    color sum = sky(direction, picture_y, 1, w);
#if HAS_ENVIRONMENT
    const real asked = (real)(w.settings->environment_weight) / total * environment_density(direction, w.material, w.environment);
    sum = color_scale(sum, pick(less(density, R(0.0)), R(1.0), power_share(density, asked)));
#endif
    for (int i = 0; i < w.settings->light_count; ++i) {
        const mask met = light_met(w.lights + i, direction);
        if (!any_lane(met)) continue;
        const real of_light = light_weight(w.lights + i, from) / total * light_density(w.lights + i, from, direction);
        const real share = pick(less(density, R(0.0)), R(1.0), power_share(density, of_light));
        sum = color_pick(met, color_add(sum, color_scale(light_shown(w.lights + i), share)), sum);
    }
    return sum;
}

// The light with a place that a path's ray meets before `far`.
typedef struct {
    mask met;
    color shows;
    real density, weight;   // with which it is asked from the ray's origin, where lights weigh as much in all as `carried` says
} lamp;

INLINE lamp lamp_met(vec origin, vec direction, int of_eye, real *far, world w) {
    lamp found = {less(R(1.0), R(0.0)), color_of(R(0.0), R(0.0), R(0.0)), R(0.0), R(0.0)};
    found.met = nearest_light(origin, direction, of_eye, far, &found.shows, &found.density, &found.weight, w);
    return found;
}

// One of all lights, chosen by what it can bring: a ray towards it, and what the ray brings to the eye if nothing is in its way.
INLINE light_ray path_asks(stage s, const packet_pixels *at, vec point, vec from, const bsdf *b, real total, world w, color *brings) {
    real u, v, choice, unused;
    path_square(s, at, PURPOSE_ASK, w, &u, &v);
    path_square(s, at, PURPOSE_CHOICE, w, &choice, &unused);
    light_ray chosen = {vec_of(R(0.0), R(0.0), R(1.0)), R(-1.0), color_of(R(0.0), R(0.0), R(0.0)), R(0.0)};
    real share = R(1.0);
    mask blocked = less(R(0.0), R(1.0));
    real place = choice * total, before = R(0.0);
    mask open = blocked, both = ~blocked;
    for (int i = 0; i <= w.settings->light_count; ++i) {
        const int is_light = i < w.settings->light_count;
        __constant const struct Light *light = w.lights + (is_light ? i : 0);
        const real weight = is_light ? light_weight(light, from) : (real)(w.settings->environment_weight);
        const mask here = open & less(place, before + weight) & less(R(0.0), weight);
        before += weight;
        open &= ~here;
        if (!any_lane(here)) continue;
        light_ray r;
        if (is_light) {
            r = light_sample(light, light_is_seen(light) ? from : point, u, v);
        } else {
#if HAS_ENVIRONMENT
            r.toward = environment_sample(u, v, w.material, w.environment, &r.density);
            r.light = environment_color(r.toward, w.material, w.environment);
            r.distance = (real)(REAL_LARGEST);
#else
            continue;
#endif
        }
        chosen.toward = vec_pick(here, r.toward, chosen.toward);
        chosen.distance = pick(here, r.distance, chosen.distance);
        chosen.light = color_pick(here, r.light, chosen.light);
        chosen.density = pick(here, r.density, chosen.density);
        share = pick(here, weight / total, share);
        if (!is_light || light_is_met(light) || light_is_seen(light)) both |= here;
        if (is_light && !light->shadow) blocked &= ~here;
    }
    // Lights hide what is behind them.
    real far = chosen.distance * R(0.999);
    const lamp hides = lamp_met(from, chosen.toward, 0, &far, w);
    chosen.light = color_pick(hides.met, color_of(R(0.0), R(0.0), R(0.0)), chosen.light);
    // A light of one direction is never met by chance.
    const mask has_size = less(R(0.0), chosen.density);
    const real asked = share * chosen.density;
    const real other = pick(both, bsdf_density(b, chosen.toward), R(0.0));
    const real weight = pick(has_size, power_share(asked, other) / asked, R(1.0) / share);
    *brings = color_scale(color_mul(bsdf_value(b, chosen.toward, w.albedos), chosen.light), weight);
    const mask dark = ~less(R(0.0), brightest(*brings));
    *brings = color_pick(dark, color_of(R(0.0), R(0.0), R(0.0)), *brings);
    // What nothing can block needs no march.
    chosen.distance = pick(blocked & ~dark, chosen.distance, R(-1.0));
    return chosen;
}

// Goes on in a direction that the surface chooses, unless Russian roulette ends the path (Arvo and Kirk 1990).
INLINE void path_goes_on(stage s, const packet_pixels *at, path *so_far, carried *with, const bsdf *b, world w) {
    real u, v, choice, roulette;
    path_square(s, at, PURPOSE_SCATTER, w, &u, &v);
    path_square(s, at, PURPOSE_CHOICES, w, &choice, &roulette);
    so_far->direction = bsdf_sample(b, choice, u, v, &with->density);
    mask on_path = mask_of(so_far->on_path) & less(R(0.0), with->density);
    const color part = color_scale(bsdf_value(b, so_far->direction, w.albedos), R(1.0) / with->density);
    so_far->through = color_pick(on_path, color_mul(so_far->through, part), so_far->through);
    on_path &= less(R(0.0), brightest(so_far->through));
    if (s.bounce >= w.settings->roulette) {
        const real stays = fmin(brightest(so_far->through), R(0.95));
        on_path &= less(roulette, stays);
        so_far->through = color_pick(on_path, color_scale(so_far->through, R(1.0) / stays), so_far->through);
    }
    so_far->on_path = number_of(on_path);
}

// Adds what a path sees at its end: a lamp, or where it leaves the set what is past it.
INLINE void path_ends(path *so_far, const carried *with, const lamp *before, mask leaves, real picture_y, world w) {
    color past = light_past(so_far->direction, picture_y, so_far->origin, with->density, with->total, w);
    const real share = power_share(with->density, before->weight / with->total * before->density);
    past = color_pick(before->met, color_scale(before->shows, share), past);
    const color more = limited(color_mul(past, so_far->through), w.settings);
    so_far->seen = color_pick(leaves | before->met, color_add(so_far->seen, more), so_far->seen);
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
    mask on_path = mask_of(so_far.on_path);
    real far = pick(mask_of(found.found), vec_dot(vec_sub(found.seen, arrived.origin), arrived.direction), (real)(REAL_LARGEST));
    lamp before = lamp_met(arrived.origin, arrived.direction, bounce == 0, &far, w);
    before.met &= on_path;
    const mask lands = on_path & mask_of(found.found) & ~before.met;
    if (bounce > 0) {
        STATE_RECALL(s, with, STATE_CARRIED);
        path_ends(&so_far, &with, &before, on_path & ~lands, a.y, w);
    } else {
        so_far.seen = color_pick(before.met, before.shows, so_far.seen);
        spot_of_light(s, &found, arrived.origin, arrived.direction, far, before.met);
    }
    with.awaited = color_of(R(0.0), R(0.0), R(0.0));
    so_far.on_path = number_of(lands);
    ray asks = {found.point, arrived.direction, R(0.0), R(-1.0), found.cone, R(0.0), RAY_NOTHING_KNOWN};
    if (any_lane(lands)) {
#if !COLORING_PER_POINT
        found.tint = spot_color(found.normal, found.quantity, OBJECT_OF(found), w);
#endif
        const pbr p = pbr_at(&found, w);
        so_far.seen = color_pick(lands, color_add(so_far.seen, color_mul(p.emission, so_far.through)), so_far.seen);
        const bsdf b = bsdf_at(&p, found.normal, vec_scale(arrived.direction, R(-1.0)), w.albedos);
        so_far.origin = vec_along(found.point, lift_of(&found, w), found.normal);
        with.total = weight_of_all(so_far.origin, w);
        const light_ray light = path_asks(s, &here.at, found.point, so_far.origin, &b, with.total, w, &with.awaited);
        with.awaited = color_mul(with.awaited, so_far.through);
        if (bounce > 0) with.awaited = limited(with.awaited, w.settings);
        asks.origin = so_far.origin;
        asks.direction = light.toward;
        asks.far = light.distance;
        asks.footprint = found.cone * (real)(w.settings->shadow_detail);
        path_goes_on(s, &here.at, &so_far, &with, &b, w);
        spot seen_first = found;
        if (bounce > 0) seen_first = spot_kept(s.state, 0, s.stride);
        so_far.footprint = found.cone;
        so_far.spread = from_eye.spread + from_eye.footprint / fmax(depth_of(seen_first.seen, a.time, w.view), found.cone);
    }
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
    const mask on_path = mask_of(so_far.on_path);
    real far = pick(mask_of(last.hit), last.t, (real)(REAL_LARGEST));
    lamp before = lamp_met(so_far.origin, so_far.direction, 0, &far, w);
    before.met &= on_path;
    path_ends(&so_far, &with, &before, on_path & ~mask_of(last.hit), a.y, w);
    const spot first_spot = spot_kept(s.state, 0, s.stride);
    end_shots(s, a, so_far.seen, &first_spot, cost, w);
}
