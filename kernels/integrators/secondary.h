// Rays that leave the surface for its light. Lights without a size have one ray each, which `find_interactions` sends; where any has a size, or
// rays go into the hemisphere, stages of their own send all (`wide_lights.h`).

INLINE color limited(color c, march_record settings) { return color_limited(c, (real)(settings->firefly_limit)); }

// Adds light to what a path has seen; after a bounce no more than the limit.
INLINE void path_sees(stage s, path *so_far, color more, mask here, world w) {
    if (s.bounce > 0) more = limited(more, w.settings);
    so_far->seen = color_pick(here, color_add(so_far->seen, more), so_far->seen);
}

// How far a ray goes to the interaction that it has met.
INLINE real way_to_interaction(const interaction *found, ray arrived) {
    return pick(mask_of(found->found), vec_dot(vec_sub(found->seen, arrived.origin), arrived.direction), (real)(REAL_LARGEST));
}

// Sends the ray of a turn from an interaction to where light may come from. `reaches`: how far it must be known what is met, see queue.h.
INLINE void send_to_light(stage s, int turn, const interaction *here, incidence in, real reaches, mask wanted, world w) {
    ray r;
    r.origin = vec_along(here->point, lift_of(here, w), here->normal);
    r.direction = in.toward;
    r.near = R(0.0);
    r.far = in.distance;
    r.footprint = here->cone * (real)(w.settings->shadow_detail);
    r.spread = R(0.0);
    r.known = RAY_NOTHING_KNOWN;
    send_clipped(s, turn, r, R(0.0), reaches, wanted & faces(s, here, in.toward, w), w);
}

// Sends an interaction's rays to lights without a size, one to each. (Faces of cuts have none in this light.)
INLINE void send_to_small_lights(stage s, const interaction *here, int turns, world w) {
    const mask found = mask_of(here->found) & ~on_face(here);
    for (int turn = 0; turn < turns; ++turn) {
        if (!any_lane(found)) {
            queue_skip(s.q, turn, s.slot);
            continue;
        }
        light_record light = w.lights + turn;
        send_to_light(s, turn, here, light_at(light, here->point, w.tables), WHETHER, light->shadow ? found : ~found & found, w);
    }
}
