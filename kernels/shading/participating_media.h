// Participating media beside the set, glass that scatters light: milk, jade, cloudy water. How far a flight
// goes is in flights.h; the set's walks are in random_walk.h.
//
// No light is sampled: the boundary would bend the way to it. So the density of the direction is -1, and all light is met by chance.
#define PURPOSE_TURN 0x10000u   // from the numbers of one scattering to those of the next

// Brings a path to where it is scattered.
INLINE void path_flies(path *so_far, real way, mask here) {
    so_far->origin = vec_pick(here, vec_along(so_far->origin, way, so_far->direction), so_far->origin);
    so_far->footprint = pick(here, so_far->footprint + so_far->spread * way, so_far->footprint);
}

// Whether nothing at all is in the way of a flight, as far as is known here: only the march knows where the set is.
INLINE mask flight_is_free(const path *so_far, const path_state *with, mask here, world w) {
    here &= ~is_set_body(body_of(with->medium), w) & less(with->flight, (real)(REAL_LARGEST));
    if (HAS(w, CLOUDS)) here &= ~here;   // they may be in the way, too
    if (!any_lane(here)) return here;
    ray r = {so_far->origin, so_far->direction, R(0.0), with->flight, so_far->footprint, so_far->spread, RAY_NOTHING_KNOWN};
    real number, far = with->flight;
    here &= less(with->flight, objects_met(&r, w.objects, w.planes, w.settings->object_count, w.tables, &number));
    here &= ~light_hit_of(r.origin, r.direction, 0, &far, w).met;
    return here & ~ray_clip(&r, w.settings->bounds_center, (real)(w.settings->bounds_radius));
}

// Scatters paths that have flown to where they are now, and again as long as nothing but the medium is in their way: all of it counts
// as one bounce. At the end their next flight is known.
INLINE void path_scatters(stage s, const packet_pixels *at, path *so_far, path_state *with, mask here, world w) {
    for (int turn = 0; turn < MOST_SCATTERINGS; ++turn) {
        if (turn > 0) {
            here &= flight_is_free(so_far, with, here, w);
            if (!any_lane(here)) return;
            flight_ends(so_far, with, (real)(REAL_LARGEST), here);
            path_flies(so_far, with->flight, here);
        }
        const uint more = PURPOSE_TURN * (uint)turn;
        real u, v, choice, roulette;
        path_square(s, at, PURPOSE_SCATTER + more, w, &u, &v);
        path_turns(so_far, with, u, v, here);
        path_square(s, at, PURPOSE_CHOICES + more, w, &choice, &roulette);
        const mask dark = here & ~less(R(0.0), brightest(so_far->through));
        so_far->on_path = pick(dark, R(0.0), so_far->on_path);
        here &= ~dark;
        if (s.bounce + turn >= w.settings->roulette) here = path_survives(so_far, roulette, here);
        path_sets_out(s, at, so_far, with, PURPOSE_FLIGHT + NEXT_BOUNCE + more, here, w);
    }
}

// Follows paths that an object's medium `scatters` on their way.
INLINE void path_was_scattered(stage s, const packet_pixels *at, path *so_far, path_state *with, mask scatters, world w) {
    if (!any_lane(scatters)) return;
    with->density = pick(scatters, R(-1.0), with->density);
    path_flies(so_far, with->flight, scatters);
    path_scatters(s, at, so_far, with, scatters, w);
}
