// Paths of light: at each spot one light is asked for directly, and one direction is followed (Kajiya 1986). What both could have
// found is weighed by the power heuristic (Veach and Guibas 1995), so neither small lights nor sharp highlights are noise.

#define NEXT_BOUNCE 16u   // from a bounce's purposes to those of the next

CALLED void path_square(stage s, const packet_pixels *at, uint purpose, world w, real *u, real *v) {
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed, purpose + NEXT_BOUNCE * (uint)s.bounce);
    unit_square((bits)((uint)s.sample), seed, u, v);
}

// The random numbers by which a spot asks for light.
INLINE void path_asking(stage s, const packet_pixels *at, world w, real numbers[ASKING_NUMBERS]) {
    real unused;
    path_square(s, at, PURPOSE_ASK, w, numbers, numbers + 1);
    path_square(s, at, PURPOSE_CHOICE, w, numbers + 2, &unused);
    numbers[3] = numbers[4] = R(0.5);
    if (w.settings->set_count > 0) path_square(s, at, PURPOSE_SET_LIGHT, w, numbers + 3, numbers + 4);
}

// Of lanes `here` one path, of the others another; likewise what they carry.
INLINE path path_pick(mask here, path yes, path no) {
    for (int i = 0; i < NUMBERS_OF(path); ++i) ((real *)&no)[i] = pick(here, ((const real *)&yes)[i], ((real *)&no)[i]);
    return no;
}

INLINE carried carried_pick(mask here, carried yes, carried no) {
    for (int i = 0; i < NUMBERS_OF(carried); ++i) ((real *)&no)[i] = pick(here, ((const real *)&yes)[i], ((real *)&no)[i]);
    return no;
}

// What each sample of each pixel has for its next walk within the set.
INLINE void walk_seeded(stage s, const packet_pixels *at, carried *with, world w) {
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed, PURPOSE_FLIGHT + NEXT_BOUNCE * (uint)s.bounce);
    const bits each = hash_bits(seed + (bits)((uint)s.sample * 0x85ebca6bu));
    with->seed_low = real_of_bits(each & 0xffffu);
    with->seed_high = real_of_bits(each >> 16);
}

// Draws the flight of a path that sets out, with the numbers of a purpose.
INLINE void path_sets_out(stage s, const packet_pixels *at, const path *so_far, carried *with, uint purpose, mask here, world w) {
    real u, choice;
    path_square(s, at, purpose, w, &u, &choice);
    flight_begins(with, so_far->through, u, choice, here);
}

// Ends paths that bring nothing, and after some bounces others by Russian roulette. `here`: those that have a way to go.
INLINE void path_stays(stage s, path *so_far, mask here, real roulette, world w) {
    here &= less(R(0.0), brightest(so_far->through));
    if (s.bounce >= w.settings->roulette) here = wins_roulette(&so_far->through, fmin(brightest(so_far->through), R(0.95)), roulette, here);
    so_far->on_path = number_of(here);
}

// One of all lights: a ray towards it, and what the ray brings to the eye if nothing is in its way.
// `behind`: in glass, whether the spot is seen from inside its body.
INLINE light_ray path_asks(stage s, const packet_pixels *at, vec point, vec from, real own, const bsdf *b, real total, mask behind, world w, color *brings) {
    real numbers[ASKING_NUMBERS];
    path_asking(s, at, w, numbers);
    const asked a = light_asked(point, from, b->normal, own, numbers, total, w);
    light_ray chosen = a.ray;
    real density;
    color scattered;
    scatter_value(b, &chosen.toward, w.albedos, &scattered, &density);
    *brings = color_scale(color_mul(scattered, chosen.light), asked_weight(&a, density));
    mask dark = ~less(R(0.0), brightest(*brings));
    // A body of glass hides what is behind its surface.
    if (HAS(w, GLASS)) dark |= ~leads_out(chosen.toward, b->surface, behind);
    *brings = color_pick(dark, color_of(R(0.0), R(0.0), R(0.0)), *brings);
    // What nothing can block needs no march.
    chosen.distance = pick(~a.unblocked & ~dark, chosen.distance, R(-1.0));
    return chosen;
}

// Goes on in a direction that the surface chooses, unless roulette ends the path. The result says which
// paths go below the boundary.
INLINE mask path_goes_on(stage s, const packet_pixels *at, path *so_far, carried *with, const bsdf *b, world w) {
    real u, v, choice, roulette;
    path_square(s, at, PURPOSE_SCATTER, w, &u, &v);
    path_square(s, at, PURPOSE_CHOICES, w, &choice, &roulette);
    real wall = R(0.5), unused;
    if (b->relief) path_square(s, at, PURPOSE_WALL, w, &wall, &unused);
    so_far->direction = scatter_sample(b, choice, u, v, wall);
    color value;
    scatter_value(b, &so_far->direction, w.albedos, &value, &with->density);
    mask on_path = mask_of(so_far->on_path) & less(R(0.0), with->density), sinks = on_path & ~on_path;
    color part = color_scale(value, R(1.0) / with->density);
    if (HAS(w, SUBSURFACE)) {
        sinks = mask_of(so_far->on_path) & b->seen & less(R(1.0) - b->by_below, choice);
        so_far->direction = vec_pick(sinks, hemisphere_direction(vec_scale(b->surface, R(-1.0)), u, v), so_far->direction);
        part = color_pick(sinks, b->below, part);
        on_path |= sinks;
    }
    so_far->through = color_pick(on_path, color_mul(so_far->through, part), so_far->through);
    path_stays(s, so_far, on_path, roulette, w);
    return sinks;
}

// Adds what a path sees at its end: a lamp, or where it leaves the set what is past it.
INLINE void path_ends(path *so_far, const carried *with, const lamp *before, mask leaves, real picture_y, world w) {
    color past = light_past(so_far->direction, picture_y, so_far->origin, with->density, with->total, w);
    const mask alone = less(with->density, R(0.0));
    const real share = pick(alone, R(1.0), power_share(with->density, before->weight / with->total * before->density));
    past = color_pick(before->met, color_scale(before->shows, share), past);
    const color more = limited(color_mul(past, so_far->through), w.settings);
    so_far->seen = color_pick(leaves | before->met, color_add(so_far->seen, more), so_far->seen);
}

// Adds what a spot shines with by itself.
INLINE void spot_shines(stage s, path *so_far, const carried *with, const spot *here, color light, mask shows, world w) {
    color more = color_mul(light, so_far->through);
    if (s.bounce > 0 && HAS(w, EMITTERS)) {
        const real distance = vec_dot(vec_sub(here->seen, so_far->origin), so_far->direction);
        more = color_scale(more, emitter_share(so_far->origin, so_far->direction, distance, here->object, with->density, with->total, w));
    }
    if (s.bounce > 0) more = limited(more, w.settings);
    so_far->seen = color_pick(shows, color_add(so_far->seen, more), so_far->seen);
}

// Adds the light of an object that the last ray of a path has met, as far as the path could also have asked for it.
INLINE void path_ends_at_emitter(stage s, path *so_far, const carried *with, encounter last, mask here, world w) {
    const real number = queue_object(s.q, 0, s.slot, last);
    const color light = emitter_light(number, w);
    here &= less(R(0.0), brightest(light));
    if (!any_lane(here)) return;
    const real share = emitter_share(so_far->origin, so_far->direction, last.t, number, with->density, with->total, w);
    const color more = limited(color_mul(color_scale(light, share), so_far->through), w.settings);
    so_far->seen = color_pick(here, color_add(so_far->seen, more), so_far->seen);
}

// A spot's material, ready to scatter by the normal `shading`, which is the surface's own, or that of its relief. `behind`: in glass,
// whether the spot is seen from inside its body.
INLINE bsdf bsdf_of_spot(stage s, const spot *here, const pbr *p, mask behind, vec to_viewer, vec *shading, world w) {
    if (HAS(w, BUMP)) *shading = bumped_normal(s, here, behind, to_viewer);
    bsdf b = bsdf_at(p, *shading, to_viewer, w.albedos);
    if (HAS(w, BUMP)) bsdf_lean(&b, here->normal);
    return b;
}

// Paths that come from below the boundary of their spot leave the medium there; the result says which. All others see the spot from
// outside: its normal faces them.
INLINE mask path_comes_out(int bounce, carried *with, spot *here, vec direction, mask lands, world w) {
    mask emerges = lands & ~lands;
    if (HAS(w, SUBSURFACE)) {
        emerges = lands & path_emerges(bounce, with, here, w);
        media_leave(with, body_of(with->medium), emerges);
        if (any_lane(emerges)) media_found(with, medium_of(with->medium, w), emerges);
    }
    here->normal = vec_pick(emerges, here->normal, facing(here->normal, direction));
    return emerges;
}

// How wide a path is from a spot on: as a pixel there, and as fast as the pixel grows before the first spot.
INLINE void path_widens(stage s, path *so_far, const spot *here, ray from_eye, real time, world w) {
    spot seen_first = *here;
    if (s.bounce > 0) seen_first = spot_kept(s, 0);
    so_far->footprint = here->cone;
    so_far->spread = from_eye.spread + from_eye.footprint / fmax(depth_of(seen_first.seen, time, w.view), here->cone);
}

// How far a path's ray goes to the spot that it has met.
INLINE real way_to_spot(const spot *found, ray arrived) {
    return pick(mask_of(found->found), vec_dot(vec_sub(found->seen, arrived.origin), arrived.direction), (real)(REAL_LARGEST));
}

// Brings a path along its ray to what it has met, and says whether that is a spot: else it is a lamp, or all past the set, or a medium has
// `halted` it before.
INLINE mask path_arrives(stage s, path *so_far, const carried *with, spot *found, ray arrived, real picture_y, mask halted, world w) {
    const mask on_path = mask_of(so_far->on_path) & ~halted;
    real far = way_to_spot(found, arrived);
    lamp before = lamp_met(arrived.origin, arrived.direction, s.bounce == 0, &far, w);
    before.met &= on_path;
    const mask lands = on_path & mask_of(found->found) & ~before.met;
    if (HAS(w, GLASS)) path_absorbs(so_far, with, far, on_path, w);
    if (s.bounce > 0) {
        path_ends(so_far, with, &before, on_path & ~lands, picture_y, w);
    } else {
        so_far->seen = color_pick(before.met, color_mul(before.shows, so_far->through), so_far->seen);
        spot_of_light(s, found, arrived.origin, arrived.direction, far, R(-1.0), before.met);
    }
    return lands;
}

// What a path carries when it leaves the eye.
INLINE carried carried_from_eye(vec eye, world w) {
    carried with = {color_of(R(0.0), R(0.0), R(0.0)), R(-1.0), R(1.0)};
    with.wave = R(-1.0);
    with.flight = (real)(REAL_LARGEST);
    if (HAS(w, GLASS)) media_begin(&with, eye, w);
    return with;
}

// What a path carries when it arrives. With media that scatter light it has been through `cross_media`; the result says which paths
// these have halted.
INLINE mask path_carries(stage s, path *so_far, carried *with, vec eye, world w) {
    const int crossed = KEEPS(s, STATE_HALT);
    if (s.bounce > 0 || crossed) {
        *with = carried_kept(s);
    } else {
        *with = carried_from_eye(eye, w);
    }
    if (!crossed) return less(R(1.0), R(0.0));
    if (s.bounce == 0) STATE_RECALL(s, *so_far, STATE_PATH);
    halt stop;
    STATE_RECALL(s, stop, STATE_HALT);
    return mask_of(stop.halted);
}

// Leaves paths that are `halted` as they are kept, with the ray by which they ask; and keeps how long rays that ask are.
INLINE void path_halts(stage s, path *so_far, carried *with, ray *asks, mask halted, world w) {
    halt stop;
    STATE_RECALL(s, stop, STATE_HALT);
    if (any_lane(halted)) {
        path p;
        STATE_RECALL(s, p, STATE_PATH);
        *so_far = path_pick(halted, p, *so_far);
        *with = carried_pick(halted, carried_kept(s), *with);
        asks->origin = vec_pick(halted, p.origin, asks->origin);
        asks->direction = vec_pick(halted, stop.toward, asks->direction);
        asks->far = pick(halted, stop.far, asks->far);
        asks->footprint = pick(halted, p.footprint * (real)(w.settings->shadow_detail), asks->footprint);
    }
    stop.halted = R(0.0);
    stop.far = asks->far;
    STATE_KEEP(s, stop, STATE_HALT);
}
