// What is kept of a sample between its stages, for each pixel of a wave; `clfractal/integrators/state.py` declares it.
#include "integrators/stage.h"

INLINE mask on_face(const interaction *here) { return is_face(here->object); }

// Around an interaction are places where the heights of its material's relief are compared, see bump_places.h.
#define AT_INTERACTION (-1)
#define BUMP_PLACES 3

#define FEW(type) (NUMBERS_OF(type) <= MOST_NUMBERS)
typedef char structs_are_small[FEW(camera_sample) && FEW(interaction) && FEW(path) && FEW(path_state) && FEW(pixel) && FEW(plane_face) && FEW(plane_layers) ? 1 : -1];

// What has halted a path before what it had met.
#define HALTED_BY_GLASS R(1.0)   // which has scattered it
#define HALTED_BY_CLOUD R(2.0)   // of which it is left where it is scattered

// Whether the scene needs a part.
#define KEEPS(s, part) ((s).at[part] >= 0)

// Where the first number of one of the parts is, and of the one that is number `i` among several.
INLINE __global scalar *state_part(stage s, int part) { return s.state + s.at[part] * s.stride; }
#define STATE_KEEP_NUMBERS(s, thing, count, to) KEEP_NUMBERS_AT(thing, count, to, (s).stride, (s).q.lanes)
#define STATE_RECALL_NUMBERS(s, thing, count, from) RECALL_NUMBERS_AT(thing, count, from, (s).stride, (s).q.lanes)
#define STATE_KEEP(s, thing, part) STATE_KEEP_NUMBERS(s, (const real *)&(thing), NUMBERS_OF(thing), state_part(s, part))
#define STATE_RECALL(s, thing, part) STATE_RECALL_NUMBERS(s, (real *)&(thing), NUMBERS_OF(thing), state_part(s, part))
#define STATE_KEPT(s, type, thing, part) type thing; STATE_RECALL(s, thing, part)
#define STATE_KEEP_ONE(s, thing, part, i) KEEP(thing, state_part(s, part) + (i) * NUMBERS_OF(thing) * (s).stride, (s).stride)
#define STATE_RECALL_ONE(s, thing, part, i) RECALL(thing, state_part(s, part) + (i) * NUMBERS_OF(thing) * (s).stride, (s).stride)

// What the formula answers for the interaction's material, or at a place around it; and the normal and escape count there.
INLINE __global scalar *asked_at(stage s, int place, int i, world w) {
    if (place == AT_INTERACTION) return state_part(s, STATE_ASKED) + i * s.stride;
    return state_part(s, STATE_BESIDE) + (place * (w.settings->bump_asked + 4 * w.settings->bump_surface) + i) * s.stride;
}
INLINE __global scalar *surface_beside_at(stage s, int place, world w) { return asked_at(s, place, w.settings->bump_asked, w); }

// Things of slices, of which `i` may be kept one after the other: TYPE_keep_one, TYPE_kept_one. Slices that the scene does not need are
// not kept, and as in `nothing`.
#define KEEP_SLICE(SLICE)                                                                                                   \
    STATE_KEEP_NUMBERS(s, (const real *)thing + SLICE##_FIRST, SLICE##_NUMBERS, state_part(s, STATE_##SLICE) + i * SLICE##_NUMBERS * s.stride);
#define RECALL_SLICE(SLICE)                                                                                                 \
    STATE_RECALL_NUMBERS(s, (real *)&thing + SLICE##_FIRST, SLICE##_NUMBERS, state_part(s, STATE_##SLICE) + i * SLICE##_NUMBERS * s.stride);
#define KEEP_SLICE_NEEDED(SLICE) if (KEEPS(s, STATE_##SLICE)) KEEP_SLICE(SLICE)
#define RECALL_SLICE_NEEDED(SLICE) if (KEEPS(s, STATE_##SLICE)) RECALL_SLICE(SLICE)
#define OF_SLICES(type, SLICES, nothing)                                                                                    \
    INLINE void type##_keep_one(stage s, const type *thing, int i) { SLICES(KEEP_SLICE, KEEP_SLICE_NEEDED) }                \
    INLINE type type##_kept_one(stage s, int i) {                                                                           \
        type thing = nothing;                                                                                               \
        SLICES(RECALL_SLICE, RECALL_SLICE_NEEDED)                                                                           \
        return thing;                                                                                                       \
    }
OF_SLICES(camera_sample, CAMERA_SAMPLE_SLICES, {R(0.0)})
OF_SLICES(interaction, INTERACTION_SLICES, {R(0.0)})
#define IN_THE_OPEN ((path_state){.wave = R(-1.0), .flight = (real)(REAL_LARGEST)})
OF_SLICES(path_state, PATH_STATE_SLICES, IN_THE_OPEN)

#define camera_sample_keep(s, a) camera_sample_keep_one(s, a, 0)
#define camera_sample_kept(s) camera_sample_kept_one(s, 0)
// The first interaction, or that after the last bounce.
#define interaction_keep(s, here, bounce) interaction_keep_one(s, here, (bounce) > 0)
#define interaction_kept(s, bounce) interaction_kept_one(s, (bounce) > 0)
#define path_state_keep(s, with) path_state_keep_one(s, with, 0)
#define path_state_kept(s) path_state_kept_one(s, 0)

// Where a number of it is kept.
INLINE int path_state_number(__constant const int *at, int number) {
    if (number < DIRECT_LIGHT_NUMBERS) return at[STATE_DIRECT_LIGHT] + number;
    number -= DIRECT_LIGHT_NUMBERS;
    return number < WITHIN_NUMBERS ? at[STATE_WITHIN] + number : at[STATE_FLIGHT] + number - WITHIN_NUMBERS;
}
