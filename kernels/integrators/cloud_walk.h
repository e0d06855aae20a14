// Walks of paths through clouds: from scattering to scattering, as long as nothing but clouds can be in the way. At each place one light
// is sampled, and one direction followed, as at surfaces. Objects and lights are known here without a march; where a ray may meet the set
// the path is put down, and the next stages march it. Each scattering counts as a bounce.
#define WALK_REFILL (LANES / 4)   // idle lanes that are worth a pause for new paths

typedef struct {
    path so_far;
    path_state with;
    halt stop;
    stream random;
    mask live, first;     // whether the lane is in a cloud, and at its first place there
    ray shadow;           // of paths that are put down at a place whose light has to be marched; else it has no length
} cloud_walk;
NUMBERS_PICKED(path)
NUMBERS_PICKED(path_state)
NUMBERS_PICKED(halt)

// The lanes of a packet that a cloud has halted.
INLINE mask cloud_halts(stage s) {
    if (paths_are_over(s)) return less(R(1.0), R(0.0));
    path so_far;
    const int on_path = s.at[STATE_PATH] + (int)(&so_far.on_path - (real *)&so_far);
    return equal(lanes_load(state_part(s, STATE_HALT)), HALTED_BY_CLOUD) & mask_of(lanes_load(s.state + on_path * s.stride));
}

// Lanes that are `fresh` take the paths of their places.
INLINE void walk_begins(cloud_walk *a, stage s, const packet_pixels *at, mask fresh, world w) {
    STATE_KEPT(s, path, so_far, STATE_PATH);
    STATE_KEPT(s, halt, stop, STATE_HALT);
    const path_state with = path_state_kept(s);
    a->so_far = path_pick(fresh, so_far, a->so_far);
    a->with = path_state_pick(fresh, with, a->with);
    a->stop = halt_pick(fresh, stop, a->stop);
    const ints counts = a->random.count;
    a->random = cloud_stream(s, at, CLOUD_WALKS, w);
    a->random.count = pick_ints(fresh, a->random.count, counts);
    a->live = fresh | (a->live & ~fresh);
    a->first = fresh;
    a->shadow.far = pick(fresh, R(-1.0), a->shadow.far);
}

// Puts paths down. (Those that are still under way are put down again.)
INLINE void walk_ends(const cloud_walk *a, stage s, world w) {
    halt over = a->stop;
    over.halted = pick(a->live, over.halted, R(0.0));
    over.far = R(-1.0);
    STATE_KEEP(s, a->so_far, STATE_PATH);
    STATE_KEEP(s, over, STATE_HALT);
    path_state_keep(s, &a->with);
    if (w.settings->bounds_radius > S(0.0)) send_clipped(s, 0, a->shadow, R(0.0), WHETHER, less(R(0.0), a->shadow.far), w);
}

// Adds light to what paths have seen, limited after the first bounce.
INLINE void walk_sees(cloud_walk *a, color more, mask here, world w) {
    const mask later = ~a->first;
    a->so_far.seen = color_pick(here, color_add(a->so_far.seen, color_pick(later, limited(more, w.settings), more)), a->so_far.seen);
}

// Samples a light, and adds what comes through clouds. The result says for which lanes its ray has to be marched first.
INLINE mask walk_samples_light(cloud_walk *a, real numbers[LIGHT_SAMPLE_NUMBERS], const medium_event *e, mask open, world w) {
    const vec origin = a->so_far.origin, none = vec_of(R(0.0), R(0.0), R(0.0));
    const sampled_light l = sample_one_light(origin, origin, none, R(0.0), numbers, a->with.total, w);
    color value;
    real density, number;
    medium_value(e, l.ray.toward, &value, &density);
    color brings = color_mul(sampled_light_brings(&l, value, density), a->so_far.through);
    open &= less(R(0.0), brightest(brings));
    const mask blocks = open & ~l.unblocked;
    ray r = {origin, l.ray.toward, R(0.0), l.ray.distance, a->so_far.footprint * (real)(w.settings->shadow_detail), R(0.0), RAY_NOTHING_KNOWN};
    mask marched = blocks & ~blocks;
    if (any_lane(blocks)) {
        if (w.settings->meets_objects) {
            open &= ~blocks | ~less(objects_met(&r, w.objects, w.planes, w.settings->object_count, w.tables, &number), r.far);
        }
        ray clipped = r;
        marched = blocks & open & ray_clip(&clipped, w.settings->bounds_center, (real)(w.settings->bounds_radius));
        const mask crosses = blocks & open;
        const real comes = clouds_passed(&origin, &r.direction, r.far, crosses, &a->random, w);
        brings = color_scale(brings, pick(crosses, comes, R(1.0)));
    }
    walk_sees(a, brings, open & ~marched, w);
    const color awaited = color_pick(a->first, brings, limited(brings, w.settings));
    a->with.awaited = color_pick(marched, awaited, color_pick(a->live, color_of(R(0.0), R(0.0), R(0.0)), a->with.awaited));
    for (int i = 0; i < NUMBERS_OF(ray); ++i) ((real *)&a->shadow)[i] = pick(marched, ((real *)&r)[i], ((real *)&a->shadow)[i]);
    return marched;
}

// Where the ray of lanes `here` ends for what is not a cloud, as far as is known here: at the set's bounds, at objects, at lights.
INLINE real walk_far(const cloud_walk *a, mask here, world w) {
    ray r = {a->so_far.origin, a->so_far.direction, R(0.0), (real)(REAL_LARGEST), a->so_far.footprint, a->so_far.spread, RAY_NOTHING_KNOWN};
    real far = (real)(REAL_LARGEST), number;
    if (w.settings->meets_objects) far = objects_met(&r, w.objects, w.planes, w.settings->object_count, w.tables, &number);
    light_hit_of(r.origin, r.direction, 0, &far, w);
    const mask bounds = ray_clip(&r, w.settings->bounds_center, (real)(w.settings->bounds_radius));
    return pick(bounds, fmin(far, r.near), far);
}

// The event of lanes that are in a cloud, and their flight to the next one.
CALLED void walk_goes_on(cloud_walk *a, stage s, const packet_pixels *at, world w) {
    const mask here = a->live, in_body = ~equal(a->with.medium, R(0.0));
    real numbers[LIGHT_SAMPLE_NUMBERS];
    for (int i = 0; i < LIGHT_SAMPLE_NUMBERS; ++i) numbers[i] = R(0.5);
    for (int i = 0; i < (w.settings->set_count > 0 ? LIGHT_SAMPLE_NUMBERS : 3); ++i) numbers[i] = stream_next(&a->random, here);
    real u = stream_next(&a->random, here), v = stream_next(&a->random, here), roulette = stream_next(&a->random, here);
    if (any_lane(here & a->first)) {
        // Those of surfaces, which lie evenly.
        real even[LIGHT_SAMPLE_NUMBERS], even_u, even_v, unused, even_roulette;
        path_light_numbers(s, at, w, even);
        path_square(s, at, PURPOSE_SCATTER, w, &even_u, &even_v);
        path_square(s, at, PURPOSE_CHOICES, w, &unused, &even_roulette);
        for (int i = 0; i < LIGHT_SAMPLE_NUMBERS; ++i) numbers[i] = pick(a->first, even[i], numbers[i]);
        u = pick(a->first, even_u, u);
        v = pick(a->first, even_v, v);
        roulette = pick(a->first, even_roulette, roulette);
    }
    const real bounce = (real)((scalar)s.bounce) + a->stop.turns;
    a->first &= equal(bounce, R(0.0));   // from here on: whether it is the path's first
    const medium_event e = {a->so_far.direction, a->stop.anisotropy};
    a->with.total = pick(here, weight_of_all(a->so_far.origin, R(0.0), w), a->with.total);
    // The boundary of a body would bend the way out of it: nobody samples light from inside.
    const mask marched = walk_samples_light(a, numbers, &e, here & ~in_body, w);
    const onward next = medium_sample(&e, u, v);
    a->so_far.direction = vec_pick(here, next.direction, a->so_far.direction);
    a->with.density = pick(here, pick(in_body, R(-1.0), next.density), a->with.density);
    color through = a->so_far.through;
    const mask stays = path_stays(&through, roulette, bounce, w.settings->roulette, here);
    a->so_far.through = color_pick(here, through, a->so_far.through);
    a->so_far.on_path = pick(here, number_of(stays), a->so_far.on_path);
    if (KEEPS(s, STATE_FLIGHT)) path_sets_out(s, at, &a->so_far, &a->with, PURPOSE_FLIGHT + NEXT_BOUNCE, here, w);
    a->stop.passed = pick(here, R(0.0), a->stop.passed);
    // Layers ask what had been seen before the second place; and a picture is the same with and without them.
    a->live = stays & ~marched & ~in_body & (s.bounce == 0 ? 0 : ~0);
    a->first &= ~a->first;
    if (!any_lane(a->live)) return;
    const real far = walk_far(a, a->live, w);
    const cloud_place found = clouds_met(&a->so_far.origin, &a->so_far.direction, far, a->live, &a->random, w);
    const mask met = a->live & found.met;
    if (HAS(w, SHINING_CLOUDS)) {
        const color shines = clouds_shine(&a->so_far.origin, &a->so_far.direction, found.t, met, &a->random, w);
        walk_sees(a, color_mul(shines, a->so_far.through), met, w);
    }
    path_in_cloud(&a->so_far, &found, met);
    const mask over = met & less((real)((scalar)w.settings->bounces), bounce + R(1.0));
    a->so_far.on_path = pick(over, R(0.0), a->so_far.on_path);
    a->stop.passed = pick(a->live & ~met, far, a->stop.passed);
    a->stop.anisotropy = pick(met, found.anisotropy, a->stop.anisotropy);
    a->live = met & ~over & mask_of(a->so_far.on_path);
    a->stop.turns += pick(a->live, R(1.0), R(0.0));
}
