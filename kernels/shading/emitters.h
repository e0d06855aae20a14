// Objects that shine, as paths sample them: solids beside the set, each as bright everywhere. (What is not is found by
// chance alone: see `clfractal/shading/emitters.py`.)
#include "shading/emitter_places.h"

// All of them, as `weight_of_all`; those with the number `own` leave themselves out.
CALLED real emitters_weight(const vec *point, real own, world w) {
    real sum = R(0.0);
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (!w.objects[i].sampled) continue;
        sum += pick(equal(own, (real)((scalar)(i + 1))), R(0.0), emitter_weight(w.objects + i, point));
    }
    return sum;
}

// The object on whose part of the row of lights the choice lies.
CALLED void sample_emitter(choosing *c, const real *numbers, world w) {
    const vec from = c->from;
    const real far_out = fmax(fmax(fabs(from.x), fabs(from.y)), fabs(from.z));
    for (int i = 0; i < w.settings->object_count; ++i) {
        __global const struct Object *o = w.objects + i;
        if (!o->sampled) continue;
        const real weight = pick(equal(c->own, (real)((scalar)(i + 1))), R(0.0), emitter_weight(o, &from));
        const real choice = clamp((c->place - c->before) / fmax(weight, (real)(REAL_SMALLEST)), R(0.0), R(1.0));
        const mask here = is_chosen(c, weight);
        if (!any_lane(here)) continue;
        const emitter_place found = emitter_chosen(o, &from, choice, numbers[0], numbers[1]);
        const vec way = emitter_in_space(o, found.way);
        const real distance = sqrt(vec_dot(way, way));
        // The shadow ray ends a little before the object, which would be in its own way.
        const real thin = fmin(fmin(EMITTER_SIDE(o, 0), EMITTER_SIDE(o, 1)), EMITTER_SIDE(o, 2));
        const real lift = R(1e-3) * thin + R(64.0) * (real)(REAL_EPSILON) * (distance + far_out);
        const mask usable = less(R(0.0), found.density);
        const light_ray r = {vec_normalize(way), distance - lift, color_pick(usable, color_splat(o->radiance), color_of(R(0.0), R(0.0), R(0.0))),
                             pick(usable, found.density, R(1.0))};
        takes(c, here, r, weight);
        c->found.both |= here;
    }
}

// The part of an object's light that a path keeps which has met it by chance, `distance` from where its direction was chosen with
// `density` among lights that weighed `total`: 1 where nobody could have sampled it.
INLINE real emitter_share(vec origin, vec direction, real distance, real number, real density, real total, world w) {
    real share = R(1.0);
    for (int i = 0; i < w.settings->object_count; ++i) {
        __global const struct Object *o = w.objects + i;
        const mask here = equal(number, (real)((scalar)(i + 1))) & less_equal(R(0.0), density);
        if (!o->sampled || !any_lane(here)) continue;
        const real weight = emitter_weight(o, &origin);
        const real of_choice = weight / total * emitter_density(o, &origin, &direction, distance);
        share = pick(here & less(R(0.0), weight) & less(R(0.0), of_choice), power_share(density, of_choice), share);
    }
    return share;
}

// What an object with a number shines with, if it is one that is sampled.
INLINE color emitter_light(real number, world w) {
    color found = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (w.objects[i].sampled) found = color_pick(equal(number, (real)((scalar)(i + 1))), color_splat(w.objects[i].radiance), found);
    }
    return found;
}
