// Places of objects that shine, chosen by paths that sample them. Nobody samples an object from inside it. A shape has in its file of
// `elements/shapes/emitters`, for "turned" points outside of it:
//   emitter_place NAME_place(vec form, vec sides, vec point, real choice, real u, real v, const vec *met)
//                                                                chooses a place that the point sees, or tells the density of what is `met`
//   real NAME_weight(vec form, vec sides, vec point, real bright)   about the irradiance that it can bring to the point; 0 inside it

// "Turned" are places from the middle of an object along its axes, in scene units.
#define EMITTER_SIDE(o, i) ((real)((o)->sides[i]))

INLINE vec emitter_turned(object_record o, vec a) { return vec_mul(object_own(o, a), vec_splat(o->sides)); }

// A turned direction as one of space.
INLINE vec emitter_in_space(object_record o, vec a) {
    const vec own = vec_mul(a, vec_splat(o->sides));
    return vec_of_axes(o, own);
}

#include "shading/emitter_choice.h"
#include "elements/shapes/emitters"

// A place of an object that a turned point outside of it sees, or the density of the one that is `met`.
#define PLACE_OF(KIND, name) case SHAPE_##KIND: return name##_place(vec_splat(o->form), vec_splat(o->sides), point, choice, u, v, met);
INLINE emitter_place emitter_place_of(object_record o, vec point, real choice, real u, real v, const vec *met) {
    switch (o->kind) { EMITTERS(PLACE_OF) default: return (emitter_place){point, R(0.0)}; }
}

// About the irradiance that an object can bring to a point; 0 inside it, and where nobody samples it.
#define WEIGHT_OF(KIND, name) case SHAPE_##KIND: return name##_weight(vec_splat(o->form), vec_splat(o->sides), point, (real)(o->luminance));
CALLED real emitter_weight(object_record o, const vec *at) {
    const vec point = emitter_turned(o, vec_sub(*at, vec_splat(o->middle)));
    switch (o->kind) { EMITTERS(WEIGHT_OF) default: return R(0.0); }
}

CALLED emitter_place emitter_chosen(object_record o, const vec *at, real choice, real u, real v) {
    return emitter_place_of(o, emitter_turned(o, vec_sub(*at, vec_splat(o->middle))), choice, u, v, 0);
}

// Where a ray from outside meets an object `distance` away: the density with which a place samples it that has chosen it.
CALLED real emitter_density(object_record o, const vec *at, const vec *direction, real distance) {
    const vec point = emitter_turned(o, vec_sub(*at, vec_splat(o->middle)));
    const vec met = vec_along(point, distance, emitter_turned(o, *direction));
    return emitter_place_of(o, point, R(0.0), R(0.5), R(0.5), &met).density;
}
