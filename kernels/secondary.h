// Rays that leave the surface for its light. Lights without a size have one ray each, which `find_spots` sends; where any has a size, or rays go
// into the hemisphere, stages of their own send all (`wide_lights.h`).

INLINE color limited(color c, march_record settings) { return color_limited(c, (real)(settings->firefly_limit)); }

// Sends the ray of a turn from a spot to where light may come from. `reaches`: how far it must be known what is met, see queue.h.
INLINE void send_to_light(stage s, int turn, const spot *here, incidence in, real reaches, mask wanted, world w) {
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

// Sends a spot's rays to lights without a size, one to each. (Faces of cuts have none in this light.)
INLINE void send_to_small_lights(stage s, const spot *here, int turns, world w) {
    const mask found = mask_of(here->found) & ~on_face(here);
    for (int turn = 0; turn < turns; ++turn) {
        if (!any_lane(found)) {
            queue_skip(s.q, turn, s.slot);
            continue;
        }
        light_record light = w.lights + turn;
        send_to_light(s, turn, here, light_at(light, here->point), WHETHER, light->shadow ? found : ~found & found, w);
    }
}
