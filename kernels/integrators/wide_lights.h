// Light from parts of the sky and from lights that have a size: rays to places of them, into the hemisphere, and to balls on the set;
// and paths that meet such lights.

// The direction to the part of a light that this ray goes to; `toward` is the direction to its middle.
INLINE vec soft_light(stage s, const packet_pixels *at, vec point, vec toward, int light_index, int turn, world w) {
    light_record light = w.lights + light_index;
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed,
                                 (uint)(PURPOSE_LIGHT + 16 * (1 + light_index + 64 * s.bounce)));
    real u, v;
    unit_square((bits)((uint)(s.sample * light->rays + turn)), seed, &u, &v);
    return light_direction(light, point, toward, u, v);
}

// Ray `turn` of the hemisphere over an interaction: the first `cosine_rays` are spread like the cosine, the others like the
// environment's brightness. `strength` is the weight of what it brings, cosine / pi over the density of both kinds together
// (the balance heuristic, Veach and Guibas 1995).
INLINE incidence ambient_ray(stage s, const packet_pixels *at, const interaction *here, int turn, world w) {
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

// The light that the ray brings from the environment to a surface that scatters the part `diffuse` of it; the ray also counts towards the open part of the hemisphere.
INLINE color ambient_light(stage s, const interaction *here, int turn, ray_hit met, real diffuse, world w, real *open) {
    if (turn < w.settings->cosine_rays) {
        const mask near = mask_of(met.hit) & less(met.t, (real)(w.settings->occlusion_distance));
        *open += pick(near, R(0.0), (real)(w.settings->occlusion_share));
    }
    if (!has_environment(w.material)) return color_of(R(0.0), R(0.0), R(0.0));
    const real strength = lanes_load(ray_strength(s, turn));
    const color bright = environment_color(queue_ray(s.q, turn, s.slot).direction, w.material, w.environment);
    const real share = pick(mask_of(met.hit), R(0.0), strength * diffuse);
    return color_of(bright.r * here->tint.r * share, bright.g * here->tint.g * share, bright.b * here->tint.b * share);
}

// The turns of the rays that leave an interaction: first those into the hemisphere, then each light's.
INLINE int hemisphere_turns(world w) { return w.settings->cosine_rays + w.settings->map_rays; }

// All turns of an interaction.
INLINE int turns_for_light(world w) { return hemisphere_turns(w) + w.settings->light_count * w.settings->light_rays + w.settings->set_rays; }

// The direction that a ray of this turn takes, and whether anything may be in its way; false for turns that a light does not need.
INLINE int turn_ray(stage s, const packet_pixels *at, const interaction *here, int turn, world w, incidence *in, mask *wanted) {
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
    light_record light = w.lights + light_index;
    if (ray_of_light >= light->rays) return 0;
    *in = light_at(light, here->point, w.tables);
    if (w.settings->soft_lights) {
        in->toward = soft_light(s, at, here->point, in->toward, light_index, ray_of_light, w);
        if (light->seen) *in = light_along(light, here->point, in->toward, w.tables);
    }
    if (!light->shadow) *wanted &= ~*wanted;
    return 1;
}

// Sends all rays that leave an interaction for its light. (Faces of cuts have none in this light.)
INLINE void send_to_wide_lights(stage s, const packet_pixels *at, const interaction *here, int turns, world w) {
    const mask found = mask_of(here->found) & ~on_face(here);
    for (int turn = 0; turn < turns; ++turn) {
        incidence in;
        mask wanted = found;
        if (!any_lane(found) || !turn_ray(s, at, here, turn, w, &in, &wanted)) {
            queue_skip(s.q, turn, s.slot);
            continue;
        }
        // How near an obstacle is matters for the open part of the hemisphere.
        const int measured = turn < w.settings->cosine_rays && w.settings->occlusion_share > S(0.0);
        send_to_light(s, turn, here, in, measured ? (real)(w.settings->occlusion_distance) : WHETHER, wanted, w);
        if (turn < hemisphere_turns(w) && has_environment(w.material)) lanes_store(in.strength, ray_strength(s, turn));
    }
}

// The light of one of the rays to balls on the set. (After the lights stands one that is white, for them.)
INLINE color set_gathered(stage s, const interaction *here, vec to_viewer, int turn, int of_set, real open, phong_material l,
                          counters *cost, world w) {
    const place_in_pass place = place_of_packet(s.span, s.packet, s.tile);
    const ray_hit met = queue_met(s.q, turn, s.slot);
    counters_met(cost, met, 0);
    color shines;
    mask shadow;
    const int number = s.sample * w.settings->set_rays + of_set;
    incidence in;
    set_incidence(here, &place.at, number, s.bounce, &in, &shines, &shadow, w);
    const color white = lit_by(s, here, in, ~mask_of(met.hit), open, to_viewer, w.lights + w.settings->light_count, l, w);
    return color_scale(color_mul(white, shines), (real)(S(1.0) / (scalar)w.settings->set_rays));
}

// The light that the interaction's rays have brought.
INLINE color wide_light_gathered(stage s, const interaction *here, vec to_viewer, counters *cost, world w) {
    color gathered = color_of(R(0.0), R(0.0), R(0.0));
    const phong_material l = phong_material_of(here, w);
    real open = R(1.0);
    int turn = 0;
    if (w.settings->occlusion_share > S(0.0)) open = R(0.0);
    for (; turn < hemisphere_turns(w); ++turn) {
        const ray_hit met = queue_met(s.q, turn, s.slot);
        counters_met(cost, met, 0);
        gathered = color_add(gathered, ambient_light(s, here, turn, met, surround_of(l), w, &open));
    }
    gathered = limited(gathered, w.settings);
    for (; turn < turns_for_light(w); ++turn) {
        const int number = turn - hemisphere_turns(w);
        const int of_set = number - w.settings->light_count * w.settings->light_rays;
        if (of_set >= 0) {
            gathered = color_add(gathered, set_gathered(s, here, to_viewer, turn, of_set, open, l, cost, w));
            continue;
        }
        light_record light = w.lights + number / w.settings->light_rays;
        if (number % w.settings->light_rays >= light->rays) continue;
        const ray_hit met = queue_met(s.q, turn, s.slot);
        counters_met(cost, met, 0);
        incidence in = light_at(light, here->point, w.tables);
        in.toward = queue_ray(s.q, turn, s.slot).direction;
        if (light->seen) in = light_along(light, here->point, in.toward, w.tables);
        const color more = lit_by(s, here, in, ~mask_of(met.hit), open, to_viewer, light, l, w);
        gathered = color_add(gathered, color_scale(more, (real)(light->share)));
    }
    return color_add(gathered, l.emission);
}

// Keeps what light a path meets before the surface, where it ends.
INLINE void path_meets_light(stage s, const path *so_far, interaction *found, ray arrived, world w) {
    real far = way_to_interaction(found, arrived);
    const light_hit before = light_hit_of(arrived.origin, arrived.direction, s.bounce == 0, &far, w);
    const mask met = mask_of(so_far->on_path) & before.met;
    const light_before there = {number_of(met), before.shows};
    STATE_KEEP(s, there, STATE_LIGHT_BEFORE);
    interaction_of_light(s, found, arrived.origin, arrived.direction, far, R(-1.0), met);
}
