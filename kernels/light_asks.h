// How paths ask lights, whatever they leave: a surface or a place in a medium. What a path could also have met by chance is weighed by the
// power heuristic (Veach and Guibas 1995).

INLINE real power_share(real own, real other) {
    const real square = own * own;
    return square / fmax(square + other * other, (real)(REAL_SMALLEST));
}

#if HAS_EMITTERS
#include "emitters.h"
#endif

// What could light a point from everywhere: the sum over the lights, and the environment. `own`: the object whose surface it is, or 0; no
// object lights itself.
INLINE real weight_of_all(vec point, real own, world w) {
    real sum = (real)(w.settings->environment_weight);
    for (int i = 0; i < w.settings->light_count; ++i) sum += light_weight(w.lights + i, point);
#if HAS_SET_LIGHTS
    sum += set_weight(point, w);
#endif
#if HAS_EMITTERS
    sum += emitters_weight(point, own, w);
#endif
    return fmax(sum, (real)(REAL_SMALLEST));
}

// What a ray that meets nothing brings, for a path that has chosen its direction with `density` where all lights weigh `total`.
// A negative density: nothing else could have found it.
INLINE color light_past(vec direction, real picture_y, vec from, real density, real total, world w) {
    color sum = sky(direction, picture_y, 1, w);
    if (has_environment(w.material)) {
        const real asked = (real)(w.settings->environment_weight) / total * environment_density(direction, w.material, w.environment);
        sum = color_scale(sum, pick(less(density, R(0.0)), R(1.0), power_share(density, asked)));
    }
    for (int i = 0; i < w.settings->light_count; ++i) {
        const mask met = light_met(w.lights + i, direction);
        if (!any_lane(met)) continue;
        const real of_light = light_weight(w.lights + i, from) / total * light_density(w.lights + i, from, direction);
        const real share = pick(less(density, R(0.0)), R(1.0), power_share(density, of_light));
        sum = color_pick(met, color_add(sum, color_scale(light_shown(w.lights + i), share)), sum);
    }
    return sum;
}

// The light with a place that a path's ray meets before `far`.
typedef struct {
    mask met;
    color shows;
    real density, weight;   // with which it is asked from the ray's origin, where lights weigh as much in all as `carried` says
} lamp;

INLINE lamp lamp_met(vec origin, vec direction, int of_eye, real *far, world w) {
    lamp found = {less(R(1.0), R(0.0)), color_of(R(0.0), R(0.0), R(0.0)), R(0.0), R(0.0)};
    found.met = nearest_light(origin, direction, of_eye, far, &found.shows, &found.density, &found.weight, w);
    return found;
}

// A light that was asked for: the ray to it, and the probability of having asked.
typedef struct {
    light_ray ray;
    real share;            // of all lights, that this one is chosen
    real reckoned;         // a factor on the density with which both ways to find it reckon
    mask both, unblocked;  // whether a path meets it by chance, too; whether nothing can be in its way
} asked;

// Numbers in (0, 1): two for the place on a light, one for the light, two for the one of those on the set.
#define ASKING_NUMBERS 5

// One of all lights, chosen by what it can bring to `from`; small ones are seen from `point`. `normal` is zero within a medium, and
// `own` as above.
INLINE asked light_asked(vec point, vec from, vec normal, real own, const real *numbers, real total, world w) {
    const real u = numbers[0], v = numbers[1], choice = numbers[2];
    light_ray chosen = {vec_of(R(0.0), R(0.0), R(1.0)), R(-1.0), color_of(R(0.0), R(0.0), R(0.0)), R(0.0)};
    real share = R(1.0);
    mask blocked = less(R(0.0), R(1.0));
    real place = choice * total, before = R(0.0);
    mask open = blocked, both = ~blocked;
    for (int i = 0; i <= w.settings->light_count; ++i) {
        const int is_light = i < w.settings->light_count;
        __constant const struct Light *light = w.lights + (is_light ? i : 0);
        const real weight = is_light ? light_weight(light, from) : (real)(w.settings->environment_weight);
        const mask here = open & less(place, before + weight) & less(R(0.0), weight);
        before += weight;
        open &= ~here;
        if (!any_lane(here)) continue;
        light_ray r;
        if (is_light) {
            r = light_sample(light, light_is_seen(light) ? from : point, u, v);
        } else {
            if (!has_environment(w.material)) continue;
            r.toward = environment_sample(u, v, w.material, w.environment, &r.density);
            r.light = environment_color(r.toward, w.material, w.environment);
            r.distance = (real)(REAL_LARGEST);
        }
        chosen.toward = vec_pick(here, r.toward, chosen.toward);
        chosen.distance = pick(here, r.distance, chosen.distance);
        chosen.light = color_pick(here, r.light, chosen.light);
        chosen.density = pick(here, r.density, chosen.density);
        share = pick(here, weight / total, share);
        if (!is_light || light_is_met(light) || light_is_seen(light)) both |= here;
        if (is_light && !light->shadow) blocked &= ~here;
    }
#if HAS_EMITTERS
    both |= emitter_asked(from, own, numbers, total, place, &before, &open, &chosen, &share, w);
#endif
    real reckoned = R(1.0);
    vec begin = from;
#if HAS_SET_LIGHTS
    const real weight_of_set = set_weight(from, w);
    const mask of_set = open & less(R(0.0), weight_of_set);
    if (any_lane(of_set)) {
        const set_choice choice_of_set = set_choose(point, normal, numbers[3], numbers[4], w);
        const set_ball ball = set_ball_of(choice_of_set.number, w);
        real distance, density;
        const vec toward = set_direction(&ball, point, u, v, &distance, &density);
        const mask shines = less(R(0.0), choice_of_set.weight);
        chosen.toward = vec_pick(of_set, toward, chosen.toward);
        chosen.distance = pick(of_set, distance, chosen.distance);
        chosen.light = color_pick(of_set, color_pick(shines, ball.light, color_of(R(0.0), R(0.0), R(0.0))), chosen.light);
        chosen.density = pick(of_set, density / pick(shines, choice_of_set.weight, R(1.0)), chosen.density);
        reckoned = pick(of_set & shines, choice_of_set.weight, reckoned);
        begin = vec_pick(of_set, point, from);
        share = pick(of_set, weight_of_set / total, share);
        both |= of_set;
        blocked &= ~of_set | ball.shadow;
    }
#endif
    // Lights hide what is behind them.
    real far = chosen.distance * R(0.999);
    const lamp hides = lamp_met(begin, chosen.toward, 0, &far, w);
    chosen.light = color_pick(hides.met, color_of(R(0.0), R(0.0), R(0.0)), chosen.light);
    const asked found = {chosen, share, reckoned, both, ~blocked};
    return found;
}

// The weight of the light that was asked for; `other`: with which density the path itself chooses this direction.
INLINE real asked_weight(const asked *a, real other) {
    // A light of one direction is never met by chance.
    const mask has_size = less(R(0.0), a->ray.density);
    const real density = a->share * a->ray.density;
    return pick(has_size, power_share(a->reckoned * density, pick(a->both, other, R(0.0))) / density, R(1.0) / a->share);
}
