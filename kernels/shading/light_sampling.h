// How paths sample lights, whatever they leave: a surface or a place in a medium. What a path could also have met by chance is weighed by the
// power heuristic (Veach and Guibas 1995).

#include "shading/lane_lamps.h"

// Lights beside those that are listed: what they add to the sum of all weights, and the one of them that is chosen, if one is.
INLINE real with_lights_beside(real sum, vec point, real own, world w);
INLINE void sample_lights_beside(choosing *c, const real *numbers, world w);

// What could light a point from everywhere: the sum over the lights, and the environment. `own`: the object whose surface it is, or 0; no
// object lights itself.
INLINE real weight_of_all(vec point, real own, world w) {
    real sum = (real)(w.settings->environment_weight);
    for (int i = 0; i < w.settings->single_lights; ++i) sum += light_weight(w.lights + i, &point, w.tables);
    if (w.settings->tree_nodes > 0) sum += tree_total(&point, LIGHT_TREE(w));
    sum = with_lights_beside(sum, point, own, w);
    return fmax(sum, (real)(REAL_SMALLEST));
}

// What a ray that meets nothing brings, for a path that has chosen its direction with `density` where all lights weigh `total`.
// A negative density: nothing else could have found it.
INLINE color light_past(vec direction, real picture_y, vec from, real density, real total, world w) {
    color sum = sky(direction, picture_y, 1, w);
    if (has_environment(w.material)) {
        const real of_choice = (real)(w.settings->environment_weight) / total * environment_density(direction, w.material, w.environment);
        sum = color_scale(sum, pick(less(density, R(0.0)), R(1.0), power_share(density, of_choice)));
    }
    for (int i = 0; i < w.settings->single_lights; ++i) {
        const mask met = light_met(w.lights + i, direction);
        if (!any_lane(met)) continue;
        const real of_light = light_weight(w.lights + i, &from, w.tables) / total * light_density(w.lights + i, from, direction);
        const real share = pick(less(density, R(0.0)), R(1.0), power_share(density, of_light));
        sum = color_pick(met, color_add(sum, color_scale(light_shown(w.lights + i), share)), sum);
    }
    return sum;
}

// One of the lights with records is chosen: its number and its weight.
INLINE void light_chosen(choosing *c, mask here, real number, real weight) {
    c->number = pick(here, number, c->number);
    c->weight = pick(here, weight, c->weight);
}

// One of the tree's lamps, where none is chosen before: by the normal, which those that are met by chance do not know any more.
INLINE void choose_in_tree(choosing *c, world w) {
    const real weight = tree_total(&c->from, LIGHT_TREE(w)), begins = c->before;
    const mask here = is_chosen(c, weight);
    if (!any_lane(here)) return;
    const real place = bounded((c->place - begins) / pick(here, weight, R(1.0)), R(0.0), R(1.0) - (real)(REAL_EPSILON));
    const tree_choice found = tree_descent(&c->from, &c->normal, 0, place, here, LIGHT_TREE(w));
    light_chosen(c, here, found.lamp, weight * found.share);
    c->found.reckoned = pick(here, found.even / found.share, c->found.reckoned);
}

// Lanes that have chosen the same light with a record ask it together: the number of the next one, or -1, and which lanes of those `left` these are.
INLINE int next_chosen(real number, mask *left, mask *here) {
    *left &= less_equal(R(0.0), number);
    if (!any_lane(*left)) return -1;
    scalar each[LANES];
    lanes_store(number, each);
    const int i = (int)each[highest_bit(lanes_bits(*left))];
    *here = *left & equal(number, (real)((scalar)i));
    *left &= ~*here;
    return i;
}

// Lanes that have chosen points or balls ask all of these together; the result says which they are.
INLINE mask sample_chosen_lamps(choosing *c, real u, real v, world w) {
    const mask asks = less_equal(R(0.0), c->number);
    const lane_lamp lamp = lane_lamp_of(c->number, asks, w.lights);
    const mask ball = mask_of(lamp.ball), here = ball | mask_of(lamp.point);
    if (!any_lane(here)) return here;
    takes(c, here, lane_lamp_sample(&lamp, c->from, c->point, u, v), c->weight);
    c->found.both |= ball;
    c->found.unblocked |= here & ~mask_of(lamp.shadow);
    return here;
}

// A place of the light that was chosen.
INLINE void sample_chosen(choosing *c, real u, real v, world w) {
    mask left = less(R(0.0), R(1.0)), here;
    if (w.settings->tree_nodes > 0) left = ~sample_chosen_lamps(c, u, v, w);
    for (int i; (i = next_chosen(c->number, &left, &here)) >= 0;) {
        light_record light = w.lights + i;
        takes(c, here, light_sample(light, light->seen ? c->from : c->point, u, v, w.tables), c->weight);
        if (light_is_met(light) || light->seen) c->found.both |= here;
        if (!light->shadow) c->found.unblocked |= here;
    }
}

// The environment, where none is chosen before.
INLINE void choose_environment(choosing *c, real u, real v, world w) {
    const real weight = (real)(w.settings->environment_weight);
    const mask here = is_chosen(c, weight);
    if (!any_lane(here) || !has_environment(w.material)) return;
    light_ray r;
    r.toward = environment_sample(u, v, w.material, w.environment, &r.density);
    r.light = environment_color(r.toward, w.material, w.environment);
    r.distance = (real)(REAL_LARGEST);
    takes(c, here, r, weight);
    c->number = pick(here, LIGHT_OF_ENVIRONMENT, c->number);
    c->found.both |= here;
}

// One of all lights, chosen by what it can bring to `from`; small ones are seen from `point`. `normal` is zero within a medium, and
// `own` as above.
INLINE choosing choose_light(vec point, vec from, vec normal, real own, const real *numbers, real total, world w) {
    const real u = numbers[0], v = numbers[1], choice = numbers[2];
    const mask all = less(R(0.0), R(1.0));
    const light_ray none = {vec_of(R(0.0), R(0.0), R(1.0)), R(-1.0), color_of(R(0.0), R(0.0), R(0.0)), R(0.0)};
    choosing c = {point, from, normal, own, total, choice * total, R(0.0), all, R(-1.0), R(0.0), {none, R(1.0), R(1.0), ~all, ~all, R(0.0)}, from};
    for (int i = 0; i < w.settings->single_lights; ++i) {
        const real weight = light_weight(w.lights + i, &from, w.tables);
        light_chosen(&c, is_chosen(&c, weight), (real)((scalar)i), weight);
    }
    if (w.settings->tree_nodes > 0) choose_in_tree(&c, w);
    sample_chosen(&c, u, v, w);
    choose_environment(&c, u, v, w);
    sample_lights_beside(&c, numbers, w);
    return c;
}

// The same as far as no other light is before it: lights hide what is behind them. (What is sought is found before that is known.)
INLINE sampled_light sample_one_light(vec point, vec from, vec normal, real own, const real *numbers, real total, world w) {
    choosing c = choose_light(point, from, normal, own, numbers, total, w);
    const mask dark = ~less(R(0.0), brightest(c.found.ray.light));
    real far = pick(dark | less(R(0.0), c.found.sought), R(0.0), c.found.ray.distance * R(0.999));
    const light_hit hides = light_hit_of(c.begin, c.found.ray.toward, 0, &far, w);
    c.found.ray.light = color_pick(hides.met, color_of(R(0.0), R(0.0), R(0.0)), c.found.ray.light);
    return c.found;
}

// The weight of the light that was sampled; `other`: with which density the path itself chooses this direction.
INLINE real sampled_light_weight(const sampled_light *a, real other) {
    // A light of one direction is never met by chance.
    const mask has_size = less(R(0.0), a->ray.density);
    const real density = a->share * a->ray.density;
    return pick(has_size, power_share(a->reckoned * density, pick(a->both, other, R(0.0))) / density, R(1.0) / a->share);
}

// What it brings if nothing is in its way, where an event scatters light from there with that value and density.
INLINE color sampled_light_brings(const sampled_light *a, color value, real density) {
    return color_scale(color_mul(value, a->ray.light), sampled_light_weight(a, density));
}

// What a path sees at its end that has chosen its direction with `density` where all lights weighed `total`: a light, or what is past all.
INLINE color light_at_end(vec origin, vec direction, const light_hit *before, real picture_y, real density, real total, world w) {
    const real of_choice = before->weight / total * before->density;
    const real share = pick(less(density, R(0.0)), R(1.0), power_share(density, of_choice));
    return color_pick(before->met, color_scale(before->shows, share), light_past(direction, picture_y, origin, density, total, w));
}
