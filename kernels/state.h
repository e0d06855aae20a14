// What is kept of a shot between its stages, for each pixel of a wave; `clfractal/renderers/state.py` declares it.

INLINE mask on_face(const spot *here) { return is_face(here->object); }

// Around a spot are places where the heights of its material's relief are compared, see bump_places.h.
#define AT_SPOT (-1)
#define BUMP_PLACES 3

#define FEW(type) (NUMBERS_OF(type) <= MOST_NUMBERS)
typedef char structs_are_small[FEW(aim) && FEW(spot) && FEW(path) && FEW(carried) && FEW(pixel) && FEW(plane_face) && FEW(plane_layers) ? 1 : -1];

// Whether the scene needs a part.
#define KEEPS(s, part) ((s).at[part] >= 0)

// Where the first number of one of the parts is, and of the one that is number `i` among several.
INLINE __global scalar *state_part(stage s, int part) { return s.state + s.at[part] * s.stride; }
#define STATE_KEEP(s, thing, part) KEEP(thing, state_part(s, part), (s).stride)
#define STATE_RECALL(s, thing, part) RECALL(thing, state_part(s, part), (s).stride)
#define STATE_KEPT(s, type, thing, part) type thing; STATE_RECALL(s, thing, part)
#define STATE_KEEP_ONE(s, thing, part, i) KEEP(thing, state_part(s, part) + (i) * NUMBERS_OF(thing) * (s).stride, (s).stride)
#define STATE_RECALL_ONE(s, thing, part, i) RECALL(thing, state_part(s, part) + (i) * NUMBERS_OF(thing) * (s).stride, (s).stride)

// What the formula answers for the spot's material, or at a place around it; and the normal and escape count there.
INLINE __global scalar *asked_at(stage s, int place, int i, world w) {
    if (place == AT_SPOT) return state_part(s, STATE_ASKED) + i * s.stride;
    return state_part(s, STATE_BESIDE) + (place * (w.settings->bump_asked + 4 * w.settings->bump_surface) + i) * s.stride;
}
INLINE __global scalar *surface_beside_at(stage s, int place, world w) { return asked_at(s, place, w.settings->bump_asked, w); }

// A slice of a thing: numbers from `first` on.
#define SLICE_KEEP(s, thing, first, count, part, i) \
    KEEP_NUMBERS((const real *)(thing) + (first), count, state_part(s, part) + (i) * (count) * (s).stride, (s).stride)
#define SLICE_RECALL(s, thing, first, count, part, i) \
    RECALL_NUMBERS((real *)(thing) + (first), count, state_part(s, part) + (i) * (count) * (s).stride, (s).stride)

INLINE void aim_keep(stage s, const aim *a) {
    SLICE_KEEP(s, a, 0, AIM_AT_NUMBERS, STATE_AIM_AT, 0);
    if (KEEPS(s, STATE_THROUGH_LENS)) SLICE_KEEP(s, a, AIM_AT_NUMBERS, THROUGH_LENS_NUMBERS, STATE_THROUGH_LENS, 0);
}

INLINE aim aim_kept(stage s) {
    aim a = {R(0.0)};
    SLICE_RECALL(s, &a, 0, AIM_AT_NUMBERS, STATE_AIM_AT, 0);
    if (KEEPS(s, STATE_THROUGH_LENS)) SLICE_RECALL(s, &a, AIM_AT_NUMBERS, THROUGH_LENS_NUMBERS, STATE_THROUGH_LENS, 0);
    return a;
}

// The first spot, or that after the last bounce.
INLINE spot spot_kept(stage s, int bounce) {
    spot here = {R(0.0)};
    SLICE_RECALL(s, &here, 0, SPOT_SEEN_NUMBERS, STATE_SPOT_SEEN, bounce > 0);
    if (KEEPS(s, STATE_SPOT_THING)) SLICE_RECALL(s, &here, SPOT_SEEN_NUMBERS, SPOT_THING_NUMBERS, STATE_SPOT_THING, bounce > 0);
    return here;
}

INLINE void spot_keep(stage s, const spot *here, int bounce) {
    SLICE_KEEP(s, here, 0, SPOT_SEEN_NUMBERS, STATE_SPOT_SEEN, bounce > 0);
    if (KEEPS(s, STATE_SPOT_THING)) SLICE_KEEP(s, here, SPOT_SEEN_NUMBERS, SPOT_THING_NUMBERS, STATE_SPOT_THING, bounce > 0);
}

// What a path carries: slices that the scene does not need say that it is in the open.
#define FLIGHT_FIRST (ASKED_LIGHT_NUMBERS + WITHIN_NUMBERS)
INLINE void carried_keep(stage s, const carried *with) {
    SLICE_KEEP(s, with, 0, ASKED_LIGHT_NUMBERS, STATE_ASKED_LIGHT, 0);
    if (KEEPS(s, STATE_WITHIN)) SLICE_KEEP(s, with, ASKED_LIGHT_NUMBERS, WITHIN_NUMBERS, STATE_WITHIN, 0);
    if (KEEPS(s, STATE_FLIGHT)) SLICE_KEEP(s, with, FLIGHT_FIRST, FLIGHT_NUMBERS, STATE_FLIGHT, 0);
}

INLINE carried carried_kept(stage s) {
    carried with = {{R(0.0)}};
    with.wave = R(-1.0);
    with.flight = (real)(REAL_LARGEST);
    SLICE_RECALL(s, &with, 0, ASKED_LIGHT_NUMBERS, STATE_ASKED_LIGHT, 0);
    if (KEEPS(s, STATE_WITHIN)) SLICE_RECALL(s, &with, ASKED_LIGHT_NUMBERS, WITHIN_NUMBERS, STATE_WITHIN, 0);
    if (KEEPS(s, STATE_FLIGHT)) SLICE_RECALL(s, &with, FLIGHT_FIRST, FLIGHT_NUMBERS, STATE_FLIGHT, 0);
    return with;
}

// Where a number of it is kept.
INLINE int carried_number(__constant const int *at, int number) {
    if (number < ASKED_LIGHT_NUMBERS) return at[STATE_ASKED_LIGHT] + number;
    number -= ASKED_LIGHT_NUMBERS;
    return number < WITHIN_NUMBERS ? at[STATE_WITHIN] + number : at[STATE_FLIGHT] + number - WITHIN_NUMBERS;
}
