// How paths sample lights, whatever they leave: a surface or a place in a medium. What a path could also have met by chance is weighed by the
// power heuristic (Veach and Guibas 1995).

// Lights beside those that are listed: what they add to the sum of all weights, and the one of them that is chosen, if one is.
INLINE real with_lights_beside(real sum, vec point, real own, world w);
INLINE void sample_lights_beside(choosing *c, const real *numbers, world w);

// What could light a point from everywhere: the sum over the lights, and the environment. `own`: the object whose surface it is, or 0; no
// object lights itself.
INLINE real weight_of_all(vec point, real own, world w) {
    real sum = (real)(w.settings->environment_weight);
    for (int i = 0; i < w.settings->light_count; ++i) sum += light_weight(w.lights + i, &point, w.tables);
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
    for (int i = 0; i < w.settings->light_count; ++i) {
        const mask met = light_met(w.lights + i, direction);
        if (!any_lane(met)) continue;
        const real of_light = light_weight(w.lights + i, &from, w.tables) / total * light_density(w.lights + i, from, direction);
        const real share = pick(less(density, R(0.0)), R(1.0), power_share(density, of_light));
        sum = color_pick(met, color_add(sum, color_scale(light_shown(w.lights + i), share)), sum);
    }
    return sum;
}

// One of all lights, chosen by what it can bring to `from`; small ones are seen from `point`. `normal` is zero within a medium, and
// `own` as above.
INLINE sampled_light sample_one_light(vec point, vec from, vec normal, real own, const real *numbers, real total, world w) {
    const real u = numbers[0], v = numbers[1], choice = numbers[2];
    const mask all = less(R(0.0), R(1.0));
    const light_ray none = {vec_of(R(0.0), R(0.0), R(1.0)), R(-1.0), color_of(R(0.0), R(0.0), R(0.0)), R(0.0)};
    choosing c = {point, from, normal, own, total, choice * total, R(0.0), all, {none, R(1.0), R(1.0), ~all, ~all}, from};
    for (int i = 0; i <= w.settings->light_count; ++i) {
        const int is_light = i < w.settings->light_count;
        __constant const struct Light *light = w.lights + (is_light ? i : 0);
        const real weight = is_light ? light_weight(light, &from, w.tables) : (real)(w.settings->environment_weight);
        const mask here = is_chosen(&c, weight);
        if (!any_lane(here)) continue;
        light_ray r;
        if (is_light) {
            r = light_sample(light, light->seen ? from : point, u, v, w.tables);
        } else {
            if (!has_environment(w.material)) continue;
            r.toward = environment_sample(u, v, w.material, w.environment, &r.density);
            r.light = environment_color(r.toward, w.material, w.environment);
            r.distance = (real)(REAL_LARGEST);
        }
        takes(&c, here, r, weight);
        if (!is_light || light_is_met(light) || light->seen) c.found.both |= here;
        if (is_light && !light->shadow) c.found.unblocked |= here;
    }
    sample_lights_beside(&c, numbers, w);
    // Lights hide what is behind them.
    real far = c.found.ray.distance * R(0.999);
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
