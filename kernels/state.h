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
#define STATE_KEEP_ONE(s, thing, part, i) KEEP(thing, state_part(s, part) + (i) * NUMBERS_OF(thing) * (s).stride, (s).stride)
#define STATE_RECALL_ONE(s, thing, part, i) RECALL(thing, state_part(s, part) + (i) * NUMBERS_OF(thing) * (s).stride, (s).stride)

// What the formula answers for the spot's material, or at a place around it; and the normal and escape count there.
INLINE __global scalar *asked_at(stage s, int place, int i, world w) {
    if (place == AT_SPOT) return state_part(s, STATE_ASKED) + i * s.stride;
    return state_part(s, STATE_BESIDE) + (place * (w.settings->bump_asked + 4 * w.settings->bump_surface) + i) * s.stride;
}
INLINE __global scalar *surface_beside_at(stage s, int place, world w) { return asked_at(s, place, w.settings->bump_asked, w); }

INLINE aim aim_kept(stage s) {
    aim a;
    STATE_RECALL(s, a, STATE_AIM);
    return a;
}

// The first spot, or that after the last bounce.
INLINE spot spot_kept(stage s, int bounce) {
    spot here;
    STATE_RECALL_ONE(s, here, STATE_SPOT, bounce > 0);
    return here;
}

INLINE void spot_keep(stage s, const spot *here, int bounce) { STATE_KEEP_ONE(s, *here, STATE_SPOT, bounce > 0); }

// What a path carries: slices that the scene does not need are 0.
INLINE void carried_keep(stage s, const carried *with) {
    const real *numbers = (const real *)with;
    numbers_keep(numbers, ASKED_LIGHT_NUMBERS, state_part(s, STATE_ASKED_LIGHT), s.stride);
    numbers += ASKED_LIGHT_NUMBERS;
    if (KEEPS(s, STATE_WITHIN)) numbers_keep(numbers, WITHIN_NUMBERS, state_part(s, STATE_WITHIN), s.stride);
    numbers += WITHIN_NUMBERS;
    if (KEEPS(s, STATE_FLIGHT)) numbers_keep(numbers, FLIGHT_NUMBERS, state_part(s, STATE_FLIGHT), s.stride);
}

// Where a number of it is kept.
INLINE int carried_number(__constant const int *at, int number) {
    if (number < ASKED_LIGHT_NUMBERS) return at[STATE_ASKED_LIGHT] + number;
    number -= ASKED_LIGHT_NUMBERS;
    return number < WITHIN_NUMBERS ? at[STATE_WITHIN] + number : at[STATE_FLIGHT] + number - WITHIN_NUMBERS;
}

INLINE carried carried_kept(stage s) {
    carried with = {{R(0.0)}};
    real *numbers = (real *)&with;
    numbers_recall(numbers, ASKED_LIGHT_NUMBERS, state_part(s, STATE_ASKED_LIGHT), s.stride);
    numbers += ASKED_LIGHT_NUMBERS;
    if (KEEPS(s, STATE_WITHIN)) numbers_recall(numbers, WITHIN_NUMBERS, state_part(s, STATE_WITHIN), s.stride);
    numbers += WITHIN_NUMBERS;
    if (KEEPS(s, STATE_FLIGHT)) numbers_recall(numbers, FLIGHT_NUMBERS, state_part(s, STATE_FLIGHT), s.stride);
    return with;
}
