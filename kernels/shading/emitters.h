// Things that shine, as paths sample them: objects beside the set by their shapes, and the set, formulas and all that has no simple shape by balls
// around them. The host lists them behind the objects (`clfractal/shading/emitters.py`).
//
// Many of them stand in a tree, as lamps do. Where one does not shine the same everywhere, or where its shape is not known, its light is sought: a ray goes there, and what it meets is asked
// what it shines with, as if a path had come there by chance (`sought_light.cl`).
#include "shading/emitter_places.h"
#include "shading/light_tree.h"

// Where the tree of what shines begins.
#define EMITTER_TREE(w) ((w).tables + (w).settings->emitter_tree)

INLINE object_record emitter_record(int i, world w) { return w.objects + w.settings->object_count + i; }

// The number of its thing, as interactions tell it.
INLINE real emitter_thing(object_record o) { return (real)((scalar)o->thing); }

// Whether a place is an emitter's own, which it does not light: nothing convex sees itself.
INLINE mask emitter_own(object_record o, real own) { return o->convex ? equal(own, emitter_thing(o)) : less(R(1.0), R(0.0)); }

// All of them, as `weight_of_all`; those with the number `own` leave themselves out.
CALLED real emitters_weight(const vec *point, real own, world w) {
    real sum = R(0.0);
    for (int i = 0; i < w.settings->single_emitters; ++i) {
        object_record o = emitter_record(i, w);
        sum += pick(emitter_own(o, own), R(0.0), emitter_weight(o, point));
    }
    if (w.settings->emitter_nodes > 0) sum += tree_total(point, EMITTER_TREE(w));
    return sum;
}

// How far before an object a ray to it ends: it would be in its own way.
INLINE real emitter_lift(object_record o, vec from, real distance) {
    const real far_out = fmax(fmax(fabs(from.x), fabs(from.y)), fabs(from.z));
    const real thin = fmin(fmin(EMITTER_SIDE(o, 0), EMITTER_SIDE(o, 1)), EMITTER_SIDE(o, 2));
    return R(1e-3) * fmin(thin, distance) + R(64.0) * (real)(REAL_EPSILON) * (distance + far_out);
}

// A place of an object, chosen by numbers in [0, 1), and the ray to it.
INLINE light_ray emitter_ray(object_record o, vec from, real choice, real u, real v) {
    const emitter_place found = emitter_chosen(o, &from, choice, u, v);
    const vec way = emitter_in_space(o, found.way);
    const real distance = sqrt(vec_dot(way, way));
    const mask usable = less(R(0.0), found.density);
    return (light_ray){vec_normalize(way), distance - emitter_lift(o, from, distance), color_pick(usable, color_splat(o->radiance), color_of(R(0.0), R(0.0), R(0.0))),
                       pick(usable, found.density, R(1.0))};
}

// Takes what a ray to an emitter brings.
INLINE void takes_emitter(choosing *c, mask here, light_ray r, real weight, object_record o) {
    takes(c, here, r, weight);
    c->number = pick(here, LIGHT_OF_OBJECT(o->thing - 1), c->number);
    c->found.both |= here;
    if (o->sought) c->found.sought = pick(here, R(1.0) + emitter_thing(o), c->found.sought);
}

// One of the tree's, where none is chosen before: lanes that have chosen the same one ask it together. One that does not light the place, which
// its nodes do not know, brings nothing.
CALLED void sample_in_tree(choosing *c, const real *numbers, world w) {
    const real weight = tree_total(&c->from, EMITTER_TREE(w)), begins = c->before;
    const mask here = is_chosen(c, weight);
    if (!any_lane(here)) return;
    const real place = bounded((c->place - begins) / pick(here, weight, R(1.0)), R(0.0), R(1.0) - (real)(REAL_EPSILON));
    const tree_choice found = tree_descent(&c->from, &c->normal, 0, place, here, EMITTER_TREE(w));
    c->found.reckoned = pick(here, found.even / found.share, c->found.reckoned);
    scalar number[LANES];
    lanes_store(found.lamp, number);
    mask left = here;
    while (any_lane(left)) {
        const int i = (int)number[highest_bit(lanes_bits(left))];
        const mask same = left & equal(found.lamp, (real)((scalar)i));
        object_record o = emitter_record(i, w);
        light_ray r = emitter_ray(o, c->from, found.left, numbers[0], numbers[1]);
        const mask dark = emitter_own(o, c->own) | ~less(R(0.0), emitter_weight(o, &c->from));
        r.light = color_pick(dark, color_of(R(0.0), R(0.0), R(0.0)), r.light);
        takes_emitter(c, same, r, weight * found.share, o);
        left &= ~same;
    }
}

// The emitter on whose part of the row of lights the choice lies.
CALLED void sample_emitter(choosing *c, const real *numbers, world w) {
    const vec from = c->from;
    for (int i = 0; i < w.settings->single_emitters; ++i) {
        object_record o = emitter_record(i, w);
        const real weight = pick(emitter_own(o, c->own), R(0.0), emitter_weight(o, &from));
        const real choice = clamp((c->place - c->before) / fmax(weight, (real)(REAL_SMALLEST)), R(0.0), R(1.0));
        const mask here = is_chosen(c, weight);
        if (!any_lane(here)) continue;
        takes_emitter(c, here, emitter_ray(o, from, choice, numbers[0], numbers[1]), weight, o);
    }
    if (w.settings->emitter_nodes > 0) sample_in_tree(c, numbers, w);
}

// What emitter number `i` weighs at a place of which is not known any more how it faces; 0 where nobody samples it.
INLINE real emitter_weighs(int i, object_record o, vec origin, mask here, world w) {
    const real alone = emitter_weight(o, &origin);
    if (i < w.settings->single_emitters) return alone;
    const vec none = vec_of(R(0.0), R(0.0), R(0.0));
    const real even = tree_descent(&origin, &none, 1, (real)((scalar)i), here, EMITTER_TREE(w)).even;
    return pick(less(R(0.0), alone), tree_total(&origin, EMITTER_TREE(w)) * even, R(0.0));
}

// The part of a thing's light that a path keeps which has met it by chance, `distance` from where its direction was chosen with
// `density` among lights that weighed `total`: 1 where nobody could have sampled it.
INLINE real emitter_share(vec origin, vec direction, real distance, real number, real density, real total, world w) {
    real share = R(1.0);
    for (int i = 0; i < w.settings->emitter_count; ++i) {
        object_record o = emitter_record(i, w);
        const mask here = equal(number, emitter_thing(o)) & less_equal(R(0.0), density);
        if (!any_lane(here)) continue;
        const real weight = emitter_weighs(i, o, origin, here, w);
        const real of_choice = weight / total * emitter_density(o, &origin, &direction, distance);
        share = pick(here & less(R(0.0), weight) & less(R(0.0), of_choice), power_share(density, of_choice), share);
    }
    return share;
}

// Whether a thing with a number is one of them.
INLINE mask is_emitter(real number, world w) {
    mask found = less(R(1.0), R(0.0));
    for (int i = 0; i < w.settings->emitter_count; ++i) found |= equal(number, emitter_thing(emitter_record(i, w)));
    return found;
}

// What a thing with a number shines with, if it is one that shines the same everywhere.
INLINE color emitter_light(real number, world w) {
    color found = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < w.settings->emitter_count; ++i) {
        object_record o = emitter_record(i, w);
        if (!o->sought) found = color_pick(equal(number, emitter_thing(o)), color_splat(o->radiance), found);
    }
    return found;
}
