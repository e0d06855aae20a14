// Glass that scatters light: milk, jade, cloudy water.
//
// Where a path sets out within such a medium the length of its flight is drawn: how far it goes until it is scattered, if nothing is
// nearer. Its extinction may differ from colour to colour. The flight is that of one colour, chosen by what the path brings of each, and
// is weighed by the chance of it in the mean of all, as if each colour had chosen (the balance heuristic; Wilkie and others 2014, Hero
// Wavelength Spectral Sampling): no colour weighs more than the sum of all did.
//
// No lamp is asked for: the boundary would bend the way to it. So the density of the direction is -1, and all light is met by chance.
#define MOST_SCATTERINGS 1024   // between two things that a path meets
#define SOUGHT_BEYOND R(4.0)     // footprints
#define PURPOSE_TURN 0x10000u   // from the numbers of one scattering to those of the next

INLINE mask is_cloudy(const carried *with) { return less(R(0.0), brightest(with->scatters)); }

// What a path brings of each colour, as parts of their sum.
INLINE color shares_of(color through) {
    return color_scale(through, R(1.0) / fmax(through.r + through.g + through.b, (real)(REAL_SMALLEST)));
}

// Draws the flight; `u` and `choice` in (0, 1).
INLINE void flight_begins(carried *with, color through, real u, real choice, mask here) {
    const color shares = shares_of(through), taken = with->extinction;
    const mask red = less(choice, shares.r), green = less(choice, shares.r + shares.g);
    const real of_one = pick(red, taken.r, pick(green, taken.g, taken.b));
    const mask ends = is_cloudy(with) & less(R(1e-20), of_one);
    const real flight = pick(ends, -log(u) / fmax(of_one, R(1e-20)), (real)(REAL_LARGEST));
    with->flight = pick(here, flight, with->flight);
}

// Likewise, with the numbers of a purpose.
INLINE void path_sets_out(stage s, const packet_pixels *at, const path *so_far, carried *with, uint purpose, mask here, world w) {
    real u, choice;
    path_square(s, at, purpose, w, &u, &choice);
    flight_begins(with, so_far->through, u, choice, here);
}

// Weighs the path's way to what it has met, `far` away, or to where it is scattered before; the result says where it is.
INLINE mask flight_ends(path *so_far, const carried *with, real far, mask here) {
    here &= is_cloudy(with);
    const mask scatters = here & less(with->flight, far);
    const real way = fmin(with->flight, far);
    const color shares = shares_of(so_far->through), comes = absorbed(color_of(R(1.0), R(1.0), R(1.0)), with->extinction, way);
    real chance = R(0.0);
#define CHANCE(c) chance += shares.c * comes.c * pick(scatters, with->extinction.c, R(1.0));
    CHANCE(r)
    CHANCE(g)
    CHANCE(b)
#undef CHANCE
    const real share = R(1.0) / fmax(chance, (real)(REAL_SMALLEST));
#define WEIGHED(c) comes.c * pick(scatters, with->extinction.c * with->scatters.c, R(1.0)) * share
    const color weights = color_of(WEIGHED(r), WEIGHED(g), WEIGHED(b));
#undef WEIGHED
    so_far->through = color_pick(here, color_mul(so_far->through, weights), so_far->through);
    return scatters;
}

// How far a ray is marched for a flight: a surface just before its end is found some footprints beyond it.
INLINE real flight_sought(const path *so_far, const carried *with, world w) {
    const real cone = (real)(w.settings->detail) * (so_far->footprint + so_far->spread * with->flight);
    return fmin(with->flight + SOUGHT_BEYOND * cone, (real)(REAL_LARGEST));
}

// Brings a path to where it is scattered.
INLINE void path_flies(path *so_far, const carried *with, mask here) {
    so_far->origin = vec_pick(here, vec_along(so_far->origin, with->flight, so_far->direction), so_far->origin);
    so_far->footprint = pick(here, so_far->footprint + so_far->spread * with->flight, so_far->footprint);
}

// Whether nothing at all is in the way of a flight, as far as is known here: only the march knows where the set is.
INLINE mask flight_is_free(const path *so_far, const carried *with, mask here, world w) {
#if HAS_OBJECTS && !HAS_CLOUDS
    here &= less(with->medium, set_body(w)) & less(with->flight, (real)(REAL_LARGEST));
    if (!any_lane(here)) return here;
    ray r = {so_far->origin, so_far->direction, R(0.0), with->flight, so_far->footprint, so_far->spread, RAY_NOTHING_KNOWN};
    real number, far = with->flight;
    here &= less(with->flight, objects_met(&r, w.objects, w.planes.planes, w.settings->object_count, w.tables, &number));
    here &= ~lamp_met(r.origin, r.direction, 0, &far, w).met;
    return here & ~ray_clip(&r, w.settings->bounds_center, (real)(w.settings->bounds_radius));
#else
    return here & ~here;
#endif
}

// Scatters paths that have flown to where they are now, and again as long as nothing but the medium is in their way: all of it counts
// as one bounce. At the end their next flight is known.
INLINE void path_scatters(stage s, const packet_pixels *at, path *so_far, carried *with, mask here, world w) {
    for (int turn = 0; turn < MOST_SCATTERINGS; ++turn) {
        if (turn > 0) {
            here &= flight_is_free(so_far, with, here, w);
            if (!any_lane(here)) return;
            flight_ends(so_far, with, (real)(REAL_LARGEST), here);
            path_flies(so_far, with, here);
        }
        const uint more = PURPOSE_TURN * (uint)turn;
        real u, v, choice, roulette;
        path_square(s, at, PURPOSE_SCATTER + more, w, &u, &v);
        so_far->direction = vec_pick(here, phase_direction(so_far->direction, u, v, with->anisotropy), so_far->direction);
        path_square(s, at, PURPOSE_CHOICES + more, w, &choice, &roulette);
        mask on_path = less(R(0.0), brightest(so_far->through));
        if (s.bounce + turn >= w.settings->roulette) {
            const real stays = fmin(brightest(so_far->through), R(0.95));
            on_path &= less(roulette, stays);
            so_far->through = color_pick(here & on_path, color_scale(so_far->through, R(1.0) / stays), so_far->through);
        }
        so_far->on_path = pick(here, number_of(on_path), so_far->on_path);
        here &= on_path;
        path_sets_out(s, at, so_far, with, PURPOSE_FLIGHT + NEXT_BOUNCE + more, here, w);
    }
}

// Follows paths that a medium `scatters` on their way: what they were when they arrived is `flown` and `within`.
INLINE void path_was_scattered(stage s, const packet_pixels *at, path *so_far, carried *with, path flown, carried within, ray arrived,
                               mask scatters, world w) {
    if (!any_lane(scatters)) return;
    flown.origin = arrived.origin;
    flown.direction = arrived.direction;
    flown.footprint = arrived.footprint;
    flown.spread = arrived.spread;
    within.density = R(-1.0);
    path_flies(&flown, &within, scatters);
    path_scatters(s, at, &flown, &within, scatters, w);
    *so_far = path_pick(scatters, flown, *so_far);
    *with = carried_pick(scatters, within, *with);
}
