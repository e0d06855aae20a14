// Rays that leave the surface for its light: towards parts of a light that has a size, and into the hemisphere.

// A colour whose brightest component is at most the limit: one sample must not outshine all others of its pixel.
INLINE color limited(color c, __constant const struct March *settings) {
    const real brightest = fmax(fmax(c.r, c.g), c.b);
    const real limit = (real)(settings->firefly_limit);
    return color_scale(c, pick(less(limit, brightest), limit / brightest, R(1.0)));
}

#if HAS_SOFT_LIGHT
// The direction to the part of a light that this ray goes to; `toward` is the direction to its middle.
INLINE vec soft_light(vec toward, __constant const struct Light *light, int light_index, int turn, int sample,
                      const int *columns, const int *rows, int bounce, world w) {
    const bits seed = pixel_seed(columns, rows, (uint)w.settings->seed,
                                 (uint)(PURPOSE_LIGHT + 16 * (1 + light_index + 64 * bounce)));
    real u, v;
    unit_square((bits)((uint)(sample * light->rays + turn)), seed, &u, &v);
    return cone_direction(toward, (real)(light->spread), u, v);
}
#endif

#if HAS_AMBIENT
// Ray `turn` of the hemisphere over a spot: the first `cosine_rays` are spread like the cosine, the others like the
// environment's brightness. `strength` is the weight of what it brings, cosine / pi over the density of both kinds together
// (the balance heuristic, Veach and Guibas 1995).
INLINE incidence ambient_ray(const spot *here, int turn, int sample, const int *columns, const int *rows, int bounce, world w) {
    const int by_cosine = turn < w.settings->cosine_rays;
    const int number = by_cosine ? w.settings->cosine_rays : w.settings->map_rays;
    const int place = by_cosine ? turn : turn - w.settings->cosine_rays;
    const bits seed = pixel_seed(columns, rows, (uint)w.settings->seed,
                                 (uint)((by_cosine ? PURPOSE_AMBIENT : PURPOSE_ENVIRONMENT) + 16 * bounce));
    real u, v;
    unit_square((bits)((uint)(sample * number + place)), seed, &u, &v);
    incidence in;
    in.distance = (real)(w.settings->ambient_far);
    in.strength = R(0.0);
#if HAS_ENVIRONMENT
    real density;
    if (by_cosine) {
        in.toward = hemisphere_direction(here->normal, u, v);
        density = environment_density(in.toward, w.material, w.environment);
    } else {
        in.toward = environment_sample(u, v, w.material, w.environment, &density);
    }
    const real cosine = fmax(vec_dot(in.toward, here->normal), R(0.0)) * R(0.31830988618);
    const real both = cosine * (real)((scalar)w.settings->cosine_rays) + density * (real)((scalar)w.settings->map_rays);
    in.strength = pick(less(R(0.0), both), cosine / both, R(0.0));
#else
    in.toward = hemisphere_direction(here->normal, u, v);
#endif
    return in;
}

// The light that the ray brings from the environment; the ray also counts towards the open part of the hemisphere.
INLINE color ambient_light(const spot *here, int turn, incidence in, crossing met, world w, real *open) {
    if (turn < w.settings->cosine_rays) {
        const mask near = met.hit & less(met.t, (real)(w.settings->occlusion_distance));
        *open += pick(near, R(0.0), (real)(w.settings->occlusion_share));
    }
#if HAS_ENVIRONMENT
    const color bright = environment_color(in.toward, w.material, w.environment);
    const real share = pick(met.hit, R(0.0), in.strength * (real)(w.material->diffuse));
    return color_of(bright.r * here->tint.r * share, bright.g * here->tint.g * share, bright.b * here->tint.b * share);
#else
    return color_of(R(0.0), R(0.0), R(0.0));
#endif
}
#endif
