// What media do to light on its way: they absorb it, and some scatter it after a flight.
//
// Where a path sets out within a medium that scatters the length of its flight is drawn: how far it goes until it is scattered, if
// nothing is nearer. Its extinction may differ from colour to colour. The flight is that of one colour, chosen by what the path brings of
// each, and is weighed by the chance of it in the mean of all, as if each colour had chosen (the balance heuristic; Wilkie and others 2014,
// Hero Wavelength Spectral Sampling): no colour weighs more than the sum of all did.

INLINE mask is_participating(const path_state *with) { return less(R(0.0), brightest(with->scatters)); }

// What a medium leaves of light on a way through it.
INLINE color absorbed(color light, color extinction, real way) {
    return color_of(light.r * exp(-way * extinction.r), light.g * exp(-way * extinction.g), light.b * exp(-way * extinction.b));
}

#define MOST_SCATTERINGS 1024   // between two things that a path meets

// What a path brings of each colour, as parts of their sum.
INLINE color shares_of(color through) {
    return color_scale(through, R(1.0) / fmax(through.r + through.g + through.b, (real)(REAL_SMALLEST)));
}

// Draws the flight; `u` and `choice` in (0, 1).
INLINE void flight_begins(path_state *with, color through, real u, real choice, mask here) {
    const color shares = shares_of(through), taken = with->extinction;
    const mask red = less(choice, shares.r), green = less(choice, shares.r + shares.g);
    const real of_one = pick(red, taken.r, pick(green, taken.g, taken.b));
    const mask ends = is_participating(with) & less(R(1e-20), of_one);
    const real flight = pick(ends, -log(u) / fmax(of_one, R(1e-20)), (real)(REAL_LARGEST));
    with->flight = pick(here, flight, with->flight);
}

// Weighs the path's way to what it has met, `far` away, or to where it is scattered before; the result says where it is.
INLINE mask flight_ends(path *so_far, const path_state *with, real far, mask here) {
    here &= is_participating(with);
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

// Turns a path that is scattered, by numbers in (0, 1).
INLINE void path_turns(path *so_far, const path_state *with, real u, real v, mask here) {
    so_far->direction = vec_pick(here, phase_direction(so_far->direction, u, v, with->anisotropy), so_far->direction);
}

#include "integrators/roulette.h"

// Ends paths within a medium that bring little light; the result says which go on. All that bring more than a quarter do: where nothing is
// absorbed, any chance of an end would only be noise.
INLINE mask path_survives(path *so_far, real chance, mask here) {
    const mask goes_on = wins_roulette(&so_far->through, fmin(R(4.0) * brightest(so_far->through), R(1.0)), chance, here);
    so_far->on_path = pick(here, number_of(goes_on), so_far->on_path);
    return goes_on;
}
