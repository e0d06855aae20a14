// Objects that shine, as paths ask for them: balls, boxes and cylinders beside the set, each as bright everywhere. (What is not is found by
// chance alone: see `clfractal/renderers/emitters.py`.)
#include "emitter_places.h"

// All of them, as `weight_of_all`; those with the number `own` leave themselves out.
INLINE real emitters_weight(vec point, real own, world w) {
    real sum = R(0.0);
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (!w.objects[i].asked) continue;
        sum += pick(equal(own, (real)((scalar)(i + 1))), R(0.0), emitter_weight(w.objects + i, &point));
    }
    return sum;
}

// Among lights that are chosen by their weights: the object at whose part of their sum `place` lies, where that is still `open`.
INLINE mask emitter_asked(vec from, real own, const real *numbers, real total, real place, real *before, mask *open, light_ray *chosen,
                          real *share, world w) {
    mask any = *open & ~*open;
    const real far_out = fmax(fmax(fabs(from.x), fabs(from.y)), fabs(from.z));
    for (int i = 0; i < w.settings->object_count; ++i) {
        __global const struct Object *o = w.objects + i;
        if (!o->asked) continue;
        const real weight = pick(equal(own, (real)((scalar)(i + 1))), R(0.0), emitter_weight(o, &from));
        const mask here = *open & less(place, *before + weight) & less(R(0.0), weight);
        const real choice = clamp((place - *before) / fmax(weight, (real)(REAL_SMALLEST)), R(0.0), R(1.0));
        *before += weight;
        *open &= ~here;
        if (!any_lane(here)) continue;
        const emitter_place found = emitter_chosen(o, &from, choice, numbers[0], numbers[1]);
        const vec way = emitter_in_space(o, found.way);
        const real distance = sqrt(vec_dot(way, way));
        // The ray that asks ends a little before the object, which would be in its own way.
        const real thin = fmin(fmin(EMITTER_SIDE(o, 0), EMITTER_SIDE(o, 1)), EMITTER_SIDE(o, 2));
        const real lift = R(1e-3) * thin + R(64.0) * (real)(REAL_EPSILON) * (distance + far_out);
        const mask usable = here & less(R(0.0), found.density);
        chosen->toward = vec_pick(here, vec_normalize(way), chosen->toward);
        chosen->distance = pick(here, distance - lift, chosen->distance);
        chosen->light = color_pick(usable, color_splat(o->radiance), chosen->light);
        chosen->density = pick(here, pick(usable, found.density, R(1.0)), chosen->density);
        *share = pick(here, weight / total, *share);
        any |= here;
    }
    return any;
}

// The part of an object's light that a path keeps which has met it by chance, `distance` from where its direction was chosen with
// `density` among lights that weighed `total`: 1 where nobody could have asked for it.
INLINE real emitter_share(vec origin, vec direction, real distance, real number, real density, real total, world w) {
    real share = R(1.0);
    for (int i = 0; i < w.settings->object_count; ++i) {
        __global const struct Object *o = w.objects + i;
        const mask here = equal(number, (real)((scalar)(i + 1))) & less_equal(R(0.0), density);
        if (!o->asked || !any_lane(here)) continue;
        const real weight = emitter_weight(o, &origin);
        const real asks = weight / total * emitter_density(o, &origin, &direction, distance);
        share = pick(here & less(R(0.0), weight) & less(R(0.0), asks), power_share(density, asks), share);
    }
    return share;
}

// What an object with a number shines with, if it is one that is asked for.
INLINE color emitter_light(real number, world w) {
    color found = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (w.objects[i].asked) found = color_pick(equal(number, (real)((scalar)(i + 1))), color_splat(w.objects[i].radiance), found);
    }
    return found;
}
