// Paths of light: at each interaction one light is sampled directly, and one direction is followed (Kajiya 1986). What both could have
// found is weighed by the power heuristic (Veach and Guibas 1995), so neither small lights nor sharp highlights are noise.

#define NEXT_BOUNCE 16u   // from a bounce's purposes to those of the next

CALLED void path_square(stage s, const packet_pixels *at, uint purpose, world w, real *u, real *v) {
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed, purpose + NEXT_BOUNCE * (uint)s.bounce);
    unit_square((bits)((uint)s.sample), seed, u, v);
}

// The random numbers by which an interaction samples light.
INLINE void path_light_numbers(stage s, const packet_pixels *at, world w, real numbers[LIGHT_SAMPLE_NUMBERS]) {
    real unused;
    path_square(s, at, PURPOSE_SHADOW_RAY, w, numbers, numbers + 1);
    path_square(s, at, PURPOSE_CHOICE, w, numbers + 2, &unused);
    numbers[3] = numbers[4] = R(0.5);
    if (w.settings->set_count > 0) path_square(s, at, PURPOSE_SET_LIGHT, w, numbers + 3, numbers + 4);
}

// What each sample of each pixel has for its next walk within the set, from where it lands.
INLINE void walk_seeded(stage s, const packet_pixels *at, path_state *with, mask lands, world w) {
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed, PURPOSE_FLIGHT + NEXT_BOUNCE * (uint)s.bounce);
    const bits each = hash_bits(seed + (bits)((uint)s.sample * 0x85ebca6bu));
    with->seed_low = pick(lands, real_of_bits(each & 0xffffu), with->seed_low);
    with->seed_high = pick(lands, real_of_bits(each >> 16), with->seed_high);
}

// Draws the flight of a path that sets out, with the numbers of a purpose.
INLINE void path_sets_out(stage s, const packet_pixels *at, const path *so_far, path_state *with, uint purpose, mask here, world w) {
    real u, choice;
    path_square(s, at, purpose, w, &u, &choice);
    flight_begins(with, so_far->through, u, choice, here);
}

// One of all lights: a ray towards it, and what the ray brings to the eye if nothing is in its way; where it has to be `sought`, for a light of 1.
INLINE light_ray path_samples_light(stage s, const packet_pixels *at, const event *e, real total, world w, color *brings, real *seeks) {
    real numbers[LIGHT_SAMPLE_NUMBERS];
    path_light_numbers(s, at, w, numbers);
    const sampled_light a = sample_one_light(e->point, e->from, e->normal, e->own, numbers, total, w);
    light_ray chosen = a.ray;
    real density;
    color scattered;
    event_value(e, chosen.toward, w, &scattered, &density);
    *brings = sampled_light_brings(&a, scattered, density);
    mask dark = ~less(R(0.0), brightest(*brings));
    // A body of glass hides what is behind its surface.
    if (HAS(w, GLASS)) dark |= ~leads_out(chosen.toward, e->surface.surface, e->behind);
    *brings = color_pick(dark, color_of(R(0.0), R(0.0), R(0.0)), *brings);
    *seeks = pick(dark, R(0.0), a.sought);
    // What nothing can block needs no march.
    chosen.distance = pick(~a.unblocked & ~dark, chosen.distance, R(-1.0));
    return chosen;
}

// Where the light that was sampled `is` sought, its ray finds what it brings.
INLINE void light_is_sought(path_state *with, sought *seeks, mask is) {
    seeks->thing = pick(is, seeks->thing, R(0.0));
    is = less(R(0.0), seeks->thing);
    seeks->brings = with->awaited;
    with->awaited = color_pick(is, color_of(R(0.0), R(0.0), R(0.0)), with->awaited);
}

// Sends the ray for it, which finds what the path would find that way: from where shadow rays leave, in their direction.
INLINE void sends_sought(stage s, int turn, const sought *seeks, ray r, const path *so_far, world w) {
    STATE_KEEP(s, *seeks, STATE_SOUGHT);
    r.far = (real)(REAL_LARGEST);
    r.footprint = so_far->footprint;
    r.spread = so_far->spread;
    send_clipped(s, turn, r, R(0.0), WHICH, less(R(0.0), seeks->thing), w);
}

// Goes on in a direction that the event chooses, unless roulette ends the path. The result says which paths go below a boundary.
INLINE mask path_goes_on(stage s, const packet_pixels *at, path *so_far, path_state *with, const event *e, world w) {
    real u, v, choice, roulette, wall = R(0.5), unused;
    path_square(s, at, PURPOSE_SCATTER, w, &u, &v);
    path_square(s, at, PURPOSE_CHOICES, w, &choice, &roulette);
    if (HAS(w, BUMP)) path_square(s, at, PURPOSE_WALL, w, &wall, &unused);
    const onward found = event_sample(e, u, v, choice, wall, w);
    const mask here = mask_of(so_far->on_path), on_path = here & found.goes;
    so_far->direction = vec_pick(here, found.direction, so_far->direction);
    with->density = pick(here, found.density, with->density);
    so_far->through = color_pick(on_path, color_mul(so_far->through, found.part), so_far->through);
    so_far->on_path = number_of(path_stays(&so_far->through, roulette, (real)((scalar)s.bounce), w.settings->roulette, on_path));
    return here & found.sinks;
}

// Adds what a path sees at its end: a light, or where it leaves the set what is past it.
INLINE void path_ends(stage s, path *so_far, const path_state *with, const light_hit *before, mask leaves, real picture_y, world w) {
    const color past = light_at_end(so_far->origin, so_far->direction, before, picture_y, with->density, with->total, w);
    path_sees(s, so_far, color_mul(past, so_far->through), leaves | before->met, w);
}

// Adds what an interaction shines with by itself.
INLINE void interaction_shines(stage s, path *so_far, const path_state *with, const interaction *here, color light, mask shows, world w) {
    color more = color_mul(light, so_far->through);
    if (s.bounce > 0 && HAS(w, EMITTERS)) {
        const real distance = vec_dot(vec_sub(here->seen, so_far->origin), so_far->direction);
        more = color_scale(more, emitter_share(so_far->origin, so_far->direction, distance, here->object, with->density, with->total, w));
    }
    path_sees(s, so_far, more, shows, w);
}

// Adds the light of an object that the last ray of a path has met, as far as the path could also have sampled it.
INLINE void path_ends_at_emitter(stage s, path *so_far, const path_state *with, ray_hit last, mask here, world w) {
    const real number = queue_object(s.q, 0, s.slot, last);
    const color light = emitter_light(number, w);
    here &= less(R(0.0), brightest(light));
    if (!any_lane(here)) return;
    const real share = emitter_share(so_far->origin, so_far->direction, last.t, number, with->density, with->total, w);
    path_sees(s, so_far, color_mul(color_scale(light, share), so_far->through), here, w);
}

// An interaction's material, ready to scatter by the normal `shading`, which is the surface's own, or that of its relief. `behind`: in glass,
// whether the interaction is seen from inside its body.
INLINE bsdf bsdf_of_interaction(stage s, const interaction *here, const pbr *p, mask behind, vec to_viewer, vec *shading, world w) {
    if (HAS(w, BUMP)) *shading = bumped_normal(s, here, behind, to_viewer);
    bsdf b = bsdf_at(p, *shading, to_viewer, w.albedos);
    if (HAS(w, BUMP)) bsdf_lean(&b, here->normal);
    return b;
}

// Paths that come from below the boundary of their interaction leave the medium there; the result says which. All others see the interaction
// from outside: its normal faces them.
INLINE mask path_comes_out(int bounce, path_state *with, interaction *here, vec direction, mask lands, world w) {
    mask emerges = lands & ~lands;
    if (HAS(w, SUBSURFACE)) {
        emerges = lands & path_emerges(bounce, with, here, w);
        media_leave(with, body_of(with->medium), emerges);
        media_enter(with, body_beyond(here, w), emerges & of_the_set(here->object, w));
        if (any_lane(emerges)) media_found(with, medium_of(with->medium, w), emerges);
    }
    here->normal = vec_pick(emerges, here->normal, facing(here->normal, direction));
    return emerges;
}

// How wide a path is from an interaction on: as a pixel there, and as fast as the pixel grows before the first interaction.
INLINE void path_widens(stage s, path *so_far, const interaction *here, ray from_eye, real time, mask lands, world w) {
    interaction seen_first = *here;
    if (s.bounce > 0) seen_first = interaction_kept(s, 0);
    const real spread = from_eye.spread + from_eye.footprint / fmax(depth_of(seen_first.seen, time, w.view), here->cone);
    so_far->footprint = pick(lands, here->cone, so_far->footprint);
    so_far->spread = pick(lands, spread, so_far->spread);
}

// Brings a path along its ray to what it has met, and says whether that is an interaction: else it is a light, or all past the set, or a medium
// has `halted` it before.
INLINE mask path_arrives(stage s, path *so_far, const path_state *with, interaction *found, ray arrived, real picture_y, mask halted, world w) {
    const mask on_path = mask_of(so_far->on_path) & ~halted;
    real far = pick(on_path, way_to_interaction(found, arrived), R(0.0));
    light_hit before = light_hit_of(arrived.origin, arrived.direction, s.bounce == 0, &far, w);
    before.met &= on_path;
    const mask lands = on_path & mask_of(found->found) & ~before.met;
    if (HAS(w, GLASS)) path_absorbs(so_far, with, far, on_path, w);
    if (s.bounce > 0) {
        path_ends(s, so_far, with, &before, on_path & ~lands, picture_y, w);
    } else {
        so_far->seen = color_pick(before.met, color_mul(before.shows, so_far->through), so_far->seen);
        interaction_of_light(s, found, arrived.origin, arrived.direction, far, R(-1.0), before.met);
    }
    return lands;
}

// What a path carries when it leaves the eye.
INLINE path_state path_state_from_eye(vec eye, world w) {
    path_state with = {color_of(R(0.0), R(0.0), R(0.0)), R(-1.0), R(1.0)};
    with.wave = R(-1.0);
    with.flight = (real)(REAL_LARGEST);
    if (HAS(w, GLASS)) media_begin(&with, eye, w);
    return with;
}

// What a path carries when it arrives. With media that scatter light it has been through `cross_media`, which may have halted it.
INLINE halt path_carries(stage s, path *so_far, path_state *with, vec eye, world w) {
    const int crossed = KEEPS(s, STATE_HALT);
    halt stop = {R(0.0), R(0.0), R(-1.0), R(0.0), R(0.0)};
    *with = s.bounce > 0 || crossed ? path_state_kept(s) : path_state_from_eye(eye, w);
    if (!crossed) return stop;
    if (s.bounce == 0) STATE_RECALL(s, *so_far, STATE_PATH);
    STATE_RECALL(s, stop, STATE_HALT);
    return stop;
}
