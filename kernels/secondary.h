// Rays that leave the surface for its light: towards parts of a light that has a size, and into the hemisphere.

INLINE color limited(color c, __constant const struct March *settings) { return color_limited(c, (real)(settings->firefly_limit)); }

// The direction to the part of a light that this ray goes to; `toward` is the direction to its middle.
INLINE vec soft_light(stage s, const packet_pixels *at, vec point, vec toward, int light_index, int turn, world w) {
    __constant const struct Light *light = w.lights + light_index;
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed,
                                 (uint)(PURPOSE_LIGHT + 16 * (1 + light_index + 64 * s.bounce)));
    real u, v;
    unit_square((bits)((uint)(s.sample * light->rays + turn)), seed, &u, &v);
    return light_direction(light, point, toward, u, v);
}

// Ray `turn` of the hemisphere over a spot: the first `cosine_rays` are spread like the cosine, the others like the
// environment's brightness. `strength` is the weight of what it brings, cosine / pi over the density of both kinds together
// (the balance heuristic, Veach and Guibas 1995).
INLINE incidence ambient_ray(stage s, const packet_pixels *at, const spot *here, int turn, world w) {
    const int by_cosine = turn < w.settings->cosine_rays;
    const int number = by_cosine ? w.settings->cosine_rays : w.settings->map_rays;
    const int place = by_cosine ? turn : turn - w.settings->cosine_rays;
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed,
                                 (uint)((by_cosine ? PURPOSE_AMBIENT : PURPOSE_ENVIRONMENT) + 16 * s.bounce));
    real u, v;
    unit_square((bits)((uint)(s.sample * number + place)), seed, &u, &v);
    incidence in;
    in.distance = (real)(w.settings->ambient_far);
    in.strength = R(0.0);
    if (!has_environment(w.material)) {
        in.toward = hemisphere_direction(here->normal, u, v);
        return in;
    }
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
    return in;
}

// Where the weight of what a ray brings is kept, beside the ray.
INLINE __global scalar *ambient_strength(stage s, int turn) {
    return s.q.rays + RAY_STRENGTH * s.q.stride + turn * s.q.wave + s.slot;
}

// The light that the ray brings from the environment to a surface that scatters the part `diffuse` of it; the ray also counts towards the open part of the hemisphere.
INLINE color ambient_light(stage s, const spot *here, int turn, encounter met, real diffuse, world w, real *open) {
    if (turn < w.settings->cosine_rays) {
        const mask near = mask_of(met.hit) & less(met.t, (real)(w.settings->occlusion_distance));
        *open += pick(near, R(0.0), (real)(w.settings->occlusion_share));
    }
    if (!has_environment(w.material)) return color_of(R(0.0), R(0.0), R(0.0));
    const real strength = lanes_load(ambient_strength(s, turn));
    const color bright = environment_color(queue_ray(s.q, turn, s.slot).direction, w.material, w.environment);
    const real share = pick(mask_of(met.hit), R(0.0), strength * diffuse);
    return color_of(bright.r * here->tint.r * share, bright.g * here->tint.g * share, bright.b * here->tint.b * share);
}

// The turns of the rays that leave a spot: first those into the hemisphere, then each light's.
INLINE int hemisphere_turns(world w) { return w.settings->cosine_rays + w.settings->map_rays; }

// All turns of a spot.
INLINE int turns_for_light(world w) { return hemisphere_turns(w) + w.settings->light_count * w.settings->light_rays + w.settings->set_rays; }

// The direction that a ray of this turn takes, and whether anything may be in its way; false for turns that a light does not need.
INLINE int turn_ray(stage s, const packet_pixels *at, const spot *here, int turn, world w, incidence *in, mask *wanted) {
    if (turn < hemisphere_turns(w)) {
        *in = ambient_ray(s, at, here, turn, w);
        return 1;
    }
    const int light_index = (turn - hemisphere_turns(w)) / w.settings->light_rays;
    const int ray_of_light = (turn - hemisphere_turns(w)) % w.settings->light_rays;
    const int of_set = turn - hemisphere_turns(w) - w.settings->light_count * w.settings->light_rays;
    if (of_set >= 0) {
        color shines;
        mask shadow;
        set_incidence(here, at, s.sample * w.settings->set_rays + of_set, s.bounce, in, &shines, &shadow, w);
        *wanted &= shadow & less(R(0.0), in->strength);
        return 1;
    }
    __constant const struct Light *light = w.lights + light_index;
    if (ray_of_light >= light->rays) return 0;
    *in = light_at(light, here->point);
    if (w.settings->soft_lights) {
        in->toward = soft_light(s, at, here->point, in->toward, light_index, ray_of_light, w);
        if (light_is_seen(light)) *in = light_along(light, here->point, in->toward);
    }
    if (!light->shadow) *wanted &= ~*wanted;
    return 1;
}

// Sends all rays that leave a spot for its light. (Faces of cuts have none in this light.)
INLINE void send_for_light(stage s, const packet_pixels *at, const spot *here, int turns, world w) {
    const mask found = mask_of(here->found) & ~on_face(here);
    for (int turn = 0; turn < turns; ++turn) {
        incidence in;
        mask wanted = found;
        if (!any_lane(found) || !turn_ray(s, at, here, turn, w, &in, &wanted)) {
            queue_skip(s.q, turn, s.slot);
            continue;
        }
        wanted &= faces(s, here, in.toward, w);
        ray r;
        r.origin = vec_along(here->point, lift_of(here, w), here->normal);
        r.direction = in.toward;
        r.near = R(0.0);
        r.far = in.distance;
        r.footprint = here->cone * (real)(w.settings->shadow_detail);
        r.spread = R(0.0);
        r.known = RAY_NOTHING_KNOWN;
        // How near an obstacle is matters for the open part of the hemisphere.
        const int measured = turn < w.settings->cosine_rays && w.settings->occlusion_share > S(0.0);
        send_clipped(s, turn, r, R(0.0), measured ? (real)(w.settings->occlusion_distance) : WHETHER, wanted, w);
        if (turn < hemisphere_turns(w) && has_environment(w.material)) lanes_store(in.strength, ambient_strength(s, turn));
    }
}
