// Rays from the eye.
#include "geometry/objects.h"
#include "integrators/state.h"

// Whether a surface is one that marches find: of the set or a part of it, and not of an object beside it.
INLINE mask of_the_set(real object, world w) {
    mask found = equal(object, R(0.0));
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (w.objects[i].kind == OBJECT_JOINED) found |= equal(object, (real)((scalar)(i + 1)));
    }
    return found;
}

// Bodies that light goes through have numbers: objects their own, those of the set the ones after all objects.
INLINE mask is_set_body(real body, world w) { return less((real)((scalar)w.settings->object_count), body); }

// The body of a thing: of what is opaque, or only cuts the set, below 0.
INLINE real body_of_thing(real thing, world w) {
    real found = (real)((scalar)w.settings->set_body);
    for (int i = 0; i < w.settings->object_count; ++i) found = pick(equal(thing, (real)((scalar)(i + 1))), (real)((scalar)w.objects[i].body), found);
    return found;
}

// The other way round: a thing that is of a body of the set, or opaque; the set itself where it is.
INLINE real thing_of_body(real body, world w) {
    real found = R(0.0);
    body = pick(equal(body, (real)((scalar)BODY_OPAQUE)), R(-1.0), body);
    for (int i = 0; i < w.settings->object_count; ++i) found = pick(equal(body, (real)((scalar)w.objects[i].body)), (real)((scalar)(i + 1)), found);
    return pick(equal(body, (real)((scalar)w.settings->set_body)), R(0.0), found);
}

#define THROUGH 1   // of an object's `glass`, where light goes through it: it may go below the boundary, too

// Whether fog begins at the eye: it fills the open, and no body that light goes through.
INLINE mask fog_at_eye(vec eye, world w) {
    mask open = equal((real)((scalar)w.settings->eye_body), R(0.0));
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (w.objects[i].glass == THROUGH) open &= ~object_left(i, eye, w.objects, w.planes);
    }
    return open;
}

// The number of an object's material, or the set's; of the face of a cut its plane's, or that of what was cut there.
INLINE real object_material(real object, world w) {
    real number = (real)((scalar)w.settings->set_material);
    const real plane = plane_of_face(object), cut = thing_cut(object);
    for (int i = 0; i < w.settings->object_count; ++i) {
        const mask there = equal(cut, (real)((scalar)(i + 1)));
        number = pick(there, (real)((scalar)w.objects[i].material), number);
    }
    for (int i = 0; i < w.planes.count; ++i) {
        if (w.planes.planes[i].material < 0) continue;
        number = pick(equal(plane, (real)((scalar)i)), (real)((scalar)w.planes.planes[i].material), number);
    }
    return number;
}

INLINE real interaction_material(const interaction *here, world w) { return object_material(here->object, w); }

// The sums of the packet's pixels before this sample.
INLINE pixel sums_before(stage s, const place_in_pass *here) {
    if (s.sample == s.span.first) return pixel_before(s.span, here);
    STATE_KEPT(s, pixel, p, STATE_SUMS);
    return p;
}

CALLED ray eye_ray(const camera_sample *a, view_record view) { return camera_ray(a->x, a->y, a->lens_x, a->lens_y, a->time, view); }

INLINE camera_sample camera_sample_of(stage s, const place_in_pass *here, mask wanted) {
    real across, below;
    sample_offset(s.span, &here->at, s.sample, &across, &below);
    camera_sample a = {number_of(wanted), here->at.x + across, here->at.y + below, across * across + below * below, R(0.0), R(0.0), R(0.0)};
    sample_of_lens(&here->at, s.sample, (uint)s.span.sampling->seed, s.span.view, &a.lens_x, &a.lens_y, &a.time);
    return a;
}

// Sends a ray for the part of its way that planes which cut the set and the bounding sphere leave, from `free` on: nothing should be before.
INLINE void send_to_set(stage s, int turn, ray r, real free, mask wanted, world w) {
    real face;
    wanted &= planes_cut(&r, &face, w.planes);
    wanted &= ray_clip(&r, w.settings->bounds_center, (real)(w.settings->bounds_radius));
    lanes_store_at(r.near, s.q.rays + RAY_START * s.q.stride + turn * s.q.wave + s.slot, &s.q.lanes);
    r.near = fmax(r.near, free);
    queue_send(s.q, turn, s.slot, r, wanted);
}

// Where the weight of what a ray brings is kept, beside the ray.
INLINE __global scalar *ray_strength(stage s, int turn) { return s.q.rays + RAY_STRENGTH * s.q.stride + turn * s.q.wave + s.slot; }

// What has to be known of a ray: which surface it meets, or only whether it meets one.
#define WHICH R(0.0)
#define WHETHER ((real)(REAL_LARGEST))
#define GOES_PAST R(-1.0)

// Sends a ray for all that it may meet. Its march ends at the nearest object, and is left out where that is nearer than `enough`, unless the
// ray GOES_PAST: see `meet_objects`.
INLINE void send_clipped(stage s, int turn, ray r, real free, real enough, mask wanted, world w) {
    if (s.q.objects) {
        __global scalar *at = s.q.rays + turn * s.q.wave + s.slot;
        lanes_store_at(pick(wanted, r.far, R(-1.0)), at + RAY_OBJECT * s.q.stride, &s.q.lanes);
        lanes_store_at(OBJECT_AWAITED, at + RAY_OBJECT_NUMBER * s.q.stride, &s.q.lanes);
        lanes_store_at(enough, at + RAY_OBJECT_PLACE * s.q.stride, &s.q.lanes);
    }
    send_to_set(s, turn, r, free, wanted, w);
}

// The ray of a path that is within a body of the set, which marches of another kind take to its end, knows the body.
INLINE __global scalar *within_body(stage s) { return s.q.rays + RAY_KNOWN * s.q.stride + s.q.wave + s.slot; }

INLINE void send_within_set(stage s, ray r, real body, mask wanted, world w) {
    send_clipped(s, 1, r, R(0.0), WHICH, wanted, w);
    lanes_store_at(body, within_body(s), &s.q.lanes);
}

// The ray that finds the next interaction: the one from the eye, or after a bounce the mirrored one; and the light of the path so far.
INLINE ray path_ray(stage s, ray r, real wanted, path *so_far) {
    so_far->on_path = wanted;
    so_far->through = color_of(R(1.0), R(1.0), R(1.0));
    so_far->seen = color_of(R(0.0), R(0.0), R(0.0));
    if (s.bounce == 0) return r;
    STATE_RECALL(s, *so_far, STATE_PATH);
    r.origin = so_far->origin;
    r.direction = so_far->direction;
    r.footprint = so_far->footprint;
    r.spread = so_far->spread;
    return r;
}

// The ray that has found an interaction: that of the path, or one of the turn `turn`.
INLINE ray ray_to_interaction(stage s, int turn, world w) {
    if (turn > 0) return queue_ray(s.q, turn, s.slot);
    path so_far;
    const camera_sample a = camera_sample_kept(s);
    return path_ray(s, eye_ray(&a, w.view), a.wanted, &so_far);
}

// Where the state begins that says what light awaits that a clear body bends.
INLINE int bent_awaited(stage s) {
    bent ways;
    return s.at[STATE_BENT] + (int)((real *)&ways.awaited - (real *)&ways);
}

// Whether light that comes from beyond a boundary was sampled where the path has set out: nothing samples it there once more.
INLINE mask bent_answered(stage s, vec toward, const interaction *here, const sought *seeks) {
    bent ways;
    real answered;
    // (Its lanes may be those of several packets.)
    STATE_RECALL_NUMBERS(s, &answered, 1, state_part(s, STATE_BENT) + (int)(&ways.answered - (real *)&ways) * s.stride);
    return mask_of(answered) & ~less(R(0.0), vec_dot(toward, here->normal)) & equal(seeks->thing, R(0.0));
}

// The lanes whose paths have not ended at an earlier interaction, or for which light that they sampled is awaited: nothing is left to do for
// others. (What is kept says so from the second bounce on, and rays that are not sent stay so.)
INLINE mask paths_left(stage s) {
    if (s.bounce < 2) return less(R(0.0), R(1.0));
    // Of whole structs too much would be read.
    path so_far;
    const int on_path = s.at[STATE_PATH] + (int)(&so_far.on_path - (real *)&so_far);
    const int found = s.at[STATE_INTERACTION_SEEN] + INTERACTION_SEEN_NUMBERS, awaited = s.at[STATE_DIRECT_LIGHT];
    const int numbers[5] = {on_path, found, awaited, awaited + 1, awaited + 2};
    mask left = less(R(1.0), R(0.0));
    for (int i = 0; i < 5; ++i) left |= ~equal(lanes_load(s.state + numbers[i] * s.stride), R(0.0));
    if (KEEPS(s, STATE_HALT)) left |= ~equal(lanes_load(state_part(s, STATE_HALT)), R(0.0));
    if (KEEPS(s, STATE_BENT)) {
        for (int i = 0; i < 3; ++i) left |= ~equal(lanes_load(s.state + (bent_awaited(s) + i) * s.stride), R(0.0));
    }
    return left;
}
INLINE int paths_are_over(stage s) { return !any_lane(paths_left(s)); }
// The head of a stage along paths: packets end whose paths are over.
#define PATH_STAGE_BEGINS(name, data) STAGE_BEGINS(name, data); if (paths_are_over(name)) return
// The same of one that first reads what is kept of them.
#define KEPT_PATH_STAGE_BEGINS(name, data, path_name, state_name) \
    PATH_STAGE_BEGINS(name, data);                                \
    STATE_KEPT(name, path, path_name, STATE_PATH);                \
    path_state state_name = path_state_kept(name)
