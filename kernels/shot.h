// One shot at a pixel: its ray from the eye, the points that share its march, and what lights them, in one loop of legs
// around one march, so that the march is compiled once. Rays of several turns go together (batch.h). Legs of a path, in order:
//
//   STAGE_EYE      the ray from the eye, or after a bounce the mirrored one. With several points to the pixel the ray only
//                  finds out how far the pixel's whole cone is free
//   STAGE_POINT    each point of the pixel, from there on
//   STAGE_AMBIENT  rays into the hemisphere, for ambient occlusion and the environment's light
//   STAGE_LIGHT    shadow rays to each light
#define STAGE_EYE 0
#define STAGE_POINT 1
#define STAGE_AMBIENT 2
#define STAGE_LIGHT 3

// Turns of a stage, each with one ray of every pixel.
INLINE int stage_turns(int stage, __constant const struct March *settings) {
    if (stage == STAGE_POINT) return POINTS;
    if (stage == STAGE_AMBIENT) return settings->cosine_rays + settings->map_rays;
    return stage == STAGE_LIGHT ? settings->light_count * settings->light_rays : 1;
}

// The turn after this one: some lights need fewer rays than others.
INLINE int next_turn(int stage, int turn, world w) {
    if (stage != STAGE_LIGHT) return turn + 1;
    const int light = turn / w.settings->light_rays;
    const int next = turn + 1;
    return next - light * w.settings->light_rays < w.lights[light].rays ? next : (light + 1) * w.settings->light_rays;
}

// The shot at (x, y), in pixels from the picture's top left corner. `index` counts the shots at each lane's pixel, whose
// column and row `columns` and `rows` tell.
INLINE shot take_shot(real x, real y, int sample, const int *columns, const int *rows, mask wanted, world w, tally *cost) {
    const vec none = vec_of(R(0.0), R(0.0), R(0.0));
    const bits index = (bits)((uint)sample);
    const uint seed = (uint)w.settings->seed;
    real lens_x = R(0.0), lens_y = R(0.0);
#if HAS_LENS
    unit_square(index, pixel_seed(columns, rows, seed, PURPOSE_LENS), &lens_x, &lens_y);
    unit_disk(lens_x, lens_y, &lens_x, &lens_y);
#endif
    const ray eye_ray = camera_ray(x, y, lens_x, lens_y, w.view);

    shot result;
    result.steps = R(0.0);
    result.hit = wanted & ~wanted;
    result.coverage = R(0.0);
    result.depth = R(0.0);
    result.normal = none;
    result.point = none;
    result.smooth = R(0.0);

    color seen = color_of(R(0.0), R(0.0), R(0.0));   // light of the path so far
    color gathered = seen;                           // light of the present spot
    real through = R(1.0);                           // part of what comes next that reaches the eye
    real fog = R(0.0);
    real open = R(1.0);
    ray path = eye_ray;
    mask on_path = wanted;
#if PLANES > 0
    // Where a cutting plane opens the set, its face is visible.
    real face, face_count = R(0.0);
    color face_tint = seen;
    vec face_normal = none;
    on_path &= planes_cut(&path, &face, w.planes);
    const real face_t = path.near;
    const mask bare = planes_face(path, face, on_path, w.planes, &face_tint, &face_normal, &face_count);
    on_path &= ~bare;
#endif
    spot here;
    here.point = none;
    here.normal = none;
    here.cone = R(0.0);
    here.smooth = R(0.0);
    here.residual = R(0.0);
    here.tint = seen;
#if POINTS > 1
    pixel_points points = points_begin(columns, rows, sample, seed);
#endif
    batch rays;
    int stage = STAGE_EYE, turn = 0, bounce = 0;
    for (;;) {
        // The legs' rays: several turns at once, so that lanes need not wait for each other.
        const int goal = stage == STAGE_EYE ? (POINTS > 1 && bounce == 0 ? GOAL_TOUCH : GOAL_SURFACE)
                         : stage == STAGE_POINT ? (SEARCH == SEARCH_STEPS ? GOAL_POINT : GOAL_SURFACE) : GOAL_SHADOW;
        const int first = turn, end = stage_turns(stage, w.settings);
        int legs = 0;
        batch_clear(&rays);
        for (; legs < BATCH_TURNS && turn < end; ++legs) {
            ray leg = path;
            mask active = on_path;
            real strength = R(0.0);
            if (stage == STAGE_EYE) {
                if (goal == GOAL_TOUCH) {
                    leg.footprint *= (real)(w.settings->touch_share);
                    leg.spread *= (real)(w.settings->touch_share);
                }
            }
#if POINTS > 1
            else if (stage == STAGE_POINT) {
                leg = points_ray(&points, turn, x, y, lens_x, lens_y, w);
                active = points.touched;
            }
#endif
            else {
                incidence in;
#if HAS_AMBIENT
                if (stage == STAGE_AMBIENT) in = ambient_ray(&here, turn, sample, columns, rows, bounce, w);
#endif
                if (stage == STAGE_LIGHT) {
                    const int light_index = turn / w.settings->light_rays;
                    __constant const struct Light *light = w.lights + light_index;
                    in = light_at(light, here.point);
#if HAS_SOFT_LIGHT
                    in.toward = soft_light(in.toward, light, light_index, turn % w.settings->light_rays, sample, columns, rows,
                                           bounce, w);
#endif
                    if (light->shadow == 0) active = active & ~active;
                }
                active &= faces(&here, in.toward);
                strength = in.strength;
                // Leave the surface far enough for the ray not to meet the very bump it starts from.
                leg.origin = vec_along(here.point, here.cone * (real)(w.settings->shadow_lift), here.normal);
                leg.direction = in.toward;
                leg.near = R(0.0);
                leg.far = in.distance;
                leg.footprint = here.cone * (real)(w.settings->shadow_detail);
                leg.spread = R(0.0);
            }
#if PLANES > 0
            real side;
            active &= planes_cut(&leg, &side, w.planes);
#endif
            active &= ray_clip(&leg, w.settings->bounds_center, w.settings->bounds_radius);
            batch_add(&rays, legs, leg, strength, active);
            turn = next_turn(stage, turn, w);
        }
        batch_run(&rays, goal, w.settings, w.orbit, w.k);

        // The results of these rays.
        ray leg = path;
        crossing met = nothing_met(R(0.0));
        vec normal = none;
        real smooth = R(0.0);
        int at = first;
        for (int i = 0; i < legs; ++i) {
            leg = batch_ray(&rays, i);
            met = batch_found(&rays, i);
            cost->steps += met.steps;
            cost->count += met.count;
            if (stage <= STAGE_POINT) {
                cost->bad += met.bad;
                if (bounce == 0) result.steps += met.steps;
                if (goal != GOAL_TOUCH && any_lane(met.hit)) surface_at(leg, &met, met.hit, w, &normal, &smooth, cost);
#if POINTS > 1
                if (stage == STAGE_POINT) points_add(&points, at, leg, met, normal, smooth, w);
#endif
            } else {
                incidence in;
                in.toward = leg.direction;
                in.strength = batch_strength(&rays, i);
#if HAS_AMBIENT
                if (stage == STAGE_AMBIENT) {
                    gathered = color_pick(on_path, color_add(gathered, ambient_light(&here, at, in, met, w, &open)), gathered);
                }
#endif
                if (stage == STAGE_LIGHT) {
                    __constant const struct Light *light = w.lights + at / w.settings->light_rays;
                    const vec to_viewer = vec_scale(path.direction, R(-1.0));
                    const color more = lit_by(&here, in, ~met.hit, open, to_viewer, light, w.material);
                    gathered = color_pick(on_path, color_add(gathered, color_scale(more, (real)(light->share))), gathered);
                }
            }
            at = next_turn(stage, at, w);
        }
        if (turn < end) continue;

        // What comes next.
        if (stage == STAGE_AMBIENT) {
            gathered = limited(gathered, w.settings);
            stage = STAGE_LIGHT;
            turn = 0;
            if (w.settings->light_count > 0) continue;
        } else if (stage != STAGE_LIGHT) {
            mask found = met.hit;
            vec seen_point = here.point;
#if POINTS > 1
            if (bounce == 0) {
                if (stage == STAGE_EYE) {
                    points_touched(&points, met, eye_ray, w);
                    stage = STAGE_POINT;
                    turn = 0;
                    if (any_lane(met.hit)) continue;
                }
                found = points_spot(&points, eye_ray, &here, &result.coverage, w);
                seen_point = points.point;
            } else
#endif
            {
                here.point = vec_along(leg.origin, met.touch, leg.direction);
                seen_point = vec_along(leg.origin, met.t, leg.direction);
                here.cone = leg.footprint + leg.spread * met.t;
                here.normal = normal;
                here.smooth = smooth;
                here.residual = R(0.0);
                for (int i = 0; i < TURNS(NORMAL_COUNT); ++i) {
                    here.normals[i] = normal;
                    here.weights[i] = i == 0 ? R(1.0) : R(0.0);
                }
                here.tint = surface_color(normal, smooth, w.material, w.palette);
                if (bounce == 0) result.coverage = pick(found, R(1.0), R(0.0));
            }
#if !COLORING_PER_POINT
            if (any_lane(found)) here.tint = surface_tint(&here, path.direction, found, w);
#endif
            if (bounce == 0) {
                result.hit = found;
                result.point = seen_point;
                result.normal = here.normal;
                result.smooth = here.smooth;
                result.depth = vec_dot(vec_sub(seen_point, vec_splat(w.view->eye)), vec_splat(w.view->axis));
#if HAS_FOG
                const real way = vec_dot(vec_sub(seen_point, eye_ray.origin), eye_ray.direction);
                fog = R(1.0) - exp(-(real)(w.material->fog_density) * way);
#endif
            } else {
                const color missed = limited(color_scale(sky(path.direction, y, 1, w), through), w.settings);
                seen = color_pick(on_path & ~found, color_add(seen, missed), seen);
            }
            on_path &= found;
            if (!any_lane(on_path)) break;
            gathered = color_of(R(0.0), R(0.0), R(0.0));
            open = R(1.0);
            turn = 0;
#if HAS_AMBIENT
            open = w.settings->occlusion_share > S(0.0) ? R(0.0) : R(1.0);
            stage = STAGE_AMBIENT;
            continue;
#endif
            stage = STAGE_LIGHT;
            if (w.settings->light_count > 0) continue;
        }

        // The spot is lit; what it mirrors comes next.
        const int last = bounce == w.settings->bounces;
        const real own = last ? R(1.0) : R(1.0) - (real)(w.material->reflection);
        color added = color_scale(gathered, through * own);
        if (bounce > 0) added = limited(added, w.settings);
        seen = color_pick(on_path, color_add(seen, added), seen);
        if (last) break;
        through *= (real)(w.material->reflection);
        path.origin = vec_along(here.point, here.cone * (real)(w.settings->shadow_lift), here.normal);
        path.direction = vec_along(path.direction, R(-2.0) * vec_dot(path.direction, here.normal), here.normal);
        path.footprint = here.cone;
        path.spread = eye_ray.spread + (eye_ray.footprint / fmax(result.depth, here.cone));
        path.near = R(0.0);
        path.far = (real)(REAL_LARGEST);
        stage = STAGE_EYE;
        turn = 0;
        ++bounce;
    }
    color background = sky(eye_ray.direction, y, 0, w);
#if PLANES > 0
    seen = color_pick(bare, face_tint, seen);
    result.hit |= bare;
    result.coverage = pick(bare, R(1.0), result.coverage);
    result.point = vec_pick(bare, vec_along(eye_ray.origin, face_t, eye_ray.direction), result.point);
    result.normal = vec_pick(bare, face_normal, result.normal);
    result.smooth = pick(bare, face_count, result.smooth);
    result.depth = pick(bare, vec_dot(vec_sub(result.point, vec_splat(w.view->eye)), vec_splat(w.view->axis)), result.depth);
#if HAS_FOG
    fog = pick(bare, R(1.0) - exp(-(real)(w.material->fog_density) * face_t), fog);
#endif
#endif
#if HAS_FOG
    const color mist = color_splat(w.material->fog_color);
    seen = color_mix(seen, mist, fog);
    if (w.material->fog_background) background = mist;
#endif
    // With a transparent background what is not hit adds nothing, so that R, G, B come out premultiplied.
    if (w.material->transparent) background = color_of(R(0.0), R(0.0), R(0.0));
    seen = color_pick(result.hit, seen, background);
#if PLANES > 0
    const real way_to_it = vec_dot(vec_sub(result.point, eye_ray.origin), eye_ray.direction);
    const real object = pick(result.hit, way_to_it, (real)(REAL_LARGEST));
    return planes_into(result, seen, background, planes_seen(eye_ray, object, wanted, w.planes), w.view);
#else
    result.radiance = color_mix(background, seen, result.coverage);
    return result;
#endif
}
