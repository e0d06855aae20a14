// One sample of a volume's pixel: the ray through the grid, its light and shadows, and the planes in the picture.
#define HALVINGS 5   // of the step that met the surface

#if HAS_SHADOWS
// The part of a light that gets through to a point.
INLINE real light_through(vec point, vec normal, vec toward, real distance, mask active, world w, real *steps) {
    ray r;
    r.origin = vec_along(point, (real)(w.settings->shadow_lift), normal);
    r.direction = toward;
    r.near = R(0.0);
    r.far = distance;
#if PLANES > 0
    real side;
    active &= planes_cut(&r, &side, w.planes);
#endif
    grid_ray g;
    active &= enter(r, w, &g);
    real number = R(0.0), through = R(1.0);
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (!any_lane(active)) break;
        cell c;
        ints entry;
        real onward;
        const mask seen = look(g, number, &active, w, &c, &entry, &onward, steps);
        if (any_lane(seen)) {
            onward = pick(seen, number + R(1.0), onward);
            const real value = grid_value(c, entry, seen, w.grid);
#if SURFACE
            through = pick(seen & less((real)(w.settings->level), value), R(0.0), through);
#else
            through = pick(seen, through * (R(1.0) - opacity_of(value, w)), through);
#endif
            active &= less(R(1.0) - (real)(w.settings->opacity_limit), through);
        }
        number = onward;
    }
    return through;
}
#endif

// The light that a place of the grid sends to the viewer.
INLINE color lit(vec point, vec normal, color tint, vec to_viewer, mask active, world w, real *steps) {
    color sum = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < w.settings->light_count; ++i) {
        __constant const struct Light *light = w.lights + i;
        const incidence in = light_at(light, point);
        const mask all_lanes = equal(R(0.0), R(0.0));
        const color open = phong(tint, normal, to_viewer, in, all_lanes, R(1.0), light, w.material);
#if HAS_SHADOWS
        real share = R(1.0);
        const mask facing = active & less(R(0.0), vec_dot(normal, in.toward));
        if (light->shadow && any_lane(facing)) share = light_through(point, normal, in.toward, in.distance, facing, w, steps);
        const color dark = phong(tint, normal, to_viewer, in, ~all_lanes, R(1.0), light, w.material);
        sum = color_add(sum, color_mix(dark, open, share));
#else
        sum = color_add(sum, open);
#endif
    }
    return sum;
}

// A place without a normal faces the viewer, and so does the far side of what is transparent.
INLINE vec facing_normal(vec normal, vec to_viewer) {
    const mask none = less(vec_dot(normal, normal), R(0.5));
    const mask away = less(vec_dot(normal, to_viewer), R(0.0));
    return vec_pick(none, to_viewer, vec_pick(away, vec_scale(normal, R(-1.0)), normal));
}

#if PLANES > 0
// The plane at which a ray begins, or -1 where it begins outside the grid.
INLINE real in_grid(ray r, real face, __constant const struct Grid *about) {
    const vec offset = vec_sub(vec_along(r.origin, r.near, r.direction), vec_splat(about->corner));
    const vec scale = vec_splat(about->scale);
    const vec p = vec_of(offset.x * scale.x, offset.y * scale.y, offset.z * scale.z);
    const mask inside = less_equal(R(0.0), fmin(p.x, fmin(p.y, p.z))) & less_equal(p.x, (real)((scalar)about->sides[0])) &
                        less_equal(p.y, (real)((scalar)about->sides[1])) & less_equal(p.z, (real)((scalar)about->sides[2]));
    return pick(inside, face, R(-1.0));
}
#endif

// What is seen along a ray so far: light, and the part of what comes next that gets through; and the place where half of the
// light is stopped, with the value there (on a plane the count), which is what the data channels tell.
typedef struct {
    color light;
    real through, t, value;
    vec normal;
    mask found, on_plane, half_way;   // the last: where it was met by what came last
} sight;

// A place with the given `opacity` becomes visible; returns the part of its own light that reaches the eye.
INLINE real sight_pass(sight *s, real opacity, real t, real value, mask adds) {
    const real weight = pick(adds, s->through * opacity, R(0.0));
    s->through = pick(adds, s->through * (R(1.0) - opacity), s->through);
    const mask half_way = adds & ~s->found & less_equal(s->through, R(0.5));
    s->t = pick(half_way, t, s->t);
    s->value = pick(half_way, value, s->value);
    s->found |= half_way;
    s->half_way = half_way;
    return weight;
}

// The same, with the place's light and normal.
INLINE void sight_add(sight *s, color light, real opacity, real t, real value, vec normal, mask of_plane, mask adds) {
    const real weight = sight_pass(s, opacity, t, value, adds);
    s->light = color_pick(adds, color_add(s->light, color_scale(light, weight)), s->light);
    s->normal = vec_pick(s->half_way, normal, s->normal);
    s->on_plane |= s->half_way & of_plane;
}

#if PLANES > 0 && !SURFACE
// Adds the quads that are left before distance `until`, one after the other.
INLINE void sight_quads(sight *s, real until, mask active, const plane_hits *hits, plane_hit *next, plane_set set) {
    for (int i = 0; i < PLANES; ++i) {
        const mask here = active & less(next->distance, until);
        if (!any_lane(here)) return;
        sight_add(s, next->tint, next->alpha, next->distance, next->count, next->normal, here, here);
        *next = planes_next(hits, pick(here, next->distance, next->before), pick(here, next->index, next->after), set);
    }
}
#endif

#if !SURFACE
// A visible place that is not lit yet. One lane has no neighbours to wait for, and needs no array.
#define PENDING (LANES == 1 ? 1 : 4)
typedef struct {
    real number, value, weight;
} pending;
#endif

INLINE shot take_shot(real x, real y, real lens_x, real lens_y, mask wanted, world w, real *steps) {
    __constant const struct Grid *about = w.grid.about;
    const ray r = camera_ray(x, y, lens_x, lens_y, w.view);
    const vec to_viewer = vec_scale(r.direction, R(-1.0));
    ray kept = r;
    mask active = wanted;
#if PLANES > 0
    // Where a cutting plane opens the set, its face is visible.
    real face, face_count = R(0.0);
    color face_tint = color_of(R(0.0), R(0.0), R(0.0));
    vec face_normal = to_viewer;
    active &= planes_cut(&kept, &face, w.planes);
    const mask bare = planes_face(kept, in_grid(kept, face, about), active, w.planes, &face_tint, &face_normal, &face_count);
    active &= ~bare;
#endif
    grid_ray g;
    active &= enter(kept, w, &g);
    const vec zero = vec_of(R(0.0), R(0.0), R(0.0));
    const mask nowhere = active & ~active;
    real number = R(0.0), looked = R(0.0);
    sight e = {color_of(R(0.0), R(0.0), R(0.0)), R(1.0), R(0.0), R(0.0), zero, nowhere, nowhere, nowhere};
#if SURFACE
    mask found = nowhere;
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (!any_lane(active)) break;
        cell c;
        ints entry;
        real onward;
        const mask seen = look(g, number, &active, w, &c, &entry, &onward, &looked);
        if (any_lane(seen)) {
            const mask met = seen & less_equal((real)(w.settings->level), grid_value(c, entry, seen, w.grid));
            found |= met;
            active &= ~met;
            onward = pick(seen, number + R(1.0), onward);
        }
        number = pick(active, onward, number);
    }
    // The crossing lies between this place and the one before.
    real low = most(number - R(1.0), R(0.0)), high = number;
    for (int i = 0; i < TURNS(HALVINGS); ++i) {
        if (!any_lane(found)) break;
        const real middle = R(0.5) * (low + high);
        const cell c = cell_at(place_of(g, middle), about);
        const ints entry = brick_at(c, w.grid);
        const mask stored = found & is_stored(entry);
        const mask inside = stored & less_equal((real)(w.settings->level), grid_value(c, entry, stored, w.grid));
        high = pick(inside, middle, high);
        low = pick(inside, low, middle);
    }
    if (any_lane(found)) {
        const cell c = cell_at(place_of(g, high), about);
        const ints entry = brick_at(c, w.grid);
        const mask stored = found & is_stored(entry);
        vec normal = grid_normal(c, entry, stored, w.grid);
        const mask none = less(vec_dot(normal, normal), R(0.5));
        // A ray that begins inside, at the grid's side, meets a flat face.
        normal = vec_pick(none, to_viewer, normal);
        const real t = distance_of(g, high, w);
        const real value = pick(stored, grid_value(c, entry, stored, w.grid), R(0.0));
        const color light = lit(vec_along(r.origin, t, r.direction), normal, tint_of(value, normal, w), to_viewer, found, w,
                                &looked);
        sight_add(&e, light, R(1.0), t, value, normal, nowhere, found);
    }
#else
#if PLANES > 0
    const plane_hits hits = planes_met(r, wanted, w.planes);
    plane_hit next = planes_next(&hits, R(-1.0), R(-1.0), w.planes);
#endif
    real half_number = R(-1.0);
    // Light is the costly part: places are kept until a lane has PENDING of them, and lit together.
    pending kept_places[PENDING];
    for (int k = 0; k < TURNS(PENDING); ++k) kept_places[k].number = kept_places[k].value = kept_places[k].weight = R(0.0);
    real count = R(0.0);
    color sum = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (any_lane(active)) {
            cell c;
            ints entry;
            real onward;
            const mask seen = look(g, number, &active, w, &c, &entry, &onward, &looked);
            if (any_lane(seen)) {
                const real value = grid_value(c, entry, seen, w.grid), opacity = opacity_of(value, w);
                const mask adds = seen & less(R(0.0), opacity);
                onward = pick(seen, number + R(1.0), onward);
                if (any_lane(adds)) {
                    const real t = distance_of(g, number, w);
#if PLANES > 0
                    sight_quads(&e, t, adds, &hits, &next, w.planes);
#endif
                    const real weight = sight_pass(&e, opacity, t, value, adds);
                    for (int k = 0; k < TURNS(PENDING); ++k) {
                        const mask here = adds & equal(count, (real)((scalar)k));
                        kept_places[k].number = pick(here, number, kept_places[k].number);
                        kept_places[k].value = pick(here, value, kept_places[k].value);
                        kept_places[k].weight = pick(here, weight, kept_places[k].weight);
                    }
                    count += pick(adds, R(1.0), R(0.0));
                    half_number = pick(e.half_way, number, half_number);
                    active &= less(R(1.0) - (real)(w.settings->opacity_limit), e.through);
                }
            }
            number = onward;
        }
        if (any_lane(active) && !any_lane(less_equal((real)((scalar)PENDING), count))) continue;
        for (int k = 0; k < TURNS(PENDING); ++k) {
            const mask lit_here = less((real)((scalar)k), count);
            if (!any_lane(lit_here)) break;
            const real at = kept_places[k].number;
            const cell c = cell_at(place_of(g, at), about);
            const vec normal = facing_normal(grid_normal(c, brick_at(c, w.grid), lit_here, w.grid), to_viewer);
            const color light = lit(vec_along(r.origin, distance_of(g, at, w), r.direction), normal,
                                    tint_of(kept_places[k].value, normal, w), to_viewer, lit_here, w, &looked);
            sum = color_pick(lit_here, color_add(sum, color_scale(light, kept_places[k].weight)), sum);
            e.normal = vec_pick(lit_here & equal(at, half_number), normal, e.normal);
        }
        count = R(0.0);
        if (!any_lane(active)) break;
    }
    e.light = color_add(e.light, sum);
#endif
#if PLANES > 0
#if !SURFACE
    sight_quads(&e, kept.near, bare, &hits, &next, w.planes);
#endif
    sight_add(&e, face_tint, R(1.0), kept.near, face_count, face_normal, bare, bare);
#if !SURFACE
    sight_quads(&e, (real)(REAL_LARGEST), wanted, &hits, &next, w.planes);
#endif
#endif
    color background = color_of(R(0.0), R(0.0), R(0.0));
    if (!w.material->transparent) {
        const real share = clamp(y / (real)((scalar)w.view->height), R(0.0), R(1.0));
        background = color_mix(color_splat(w.material->background_top), color_splat(w.material->background_bottom), share);
    }
    shot s;
    s.coverage = R(1.0) - e.through;
    s.hit = e.found;
    s.radiance = color_add(e.light, color_scale(background, e.through));
    s.point = vec_along(r.origin, e.t, r.direction);
    s.depth = vec_dot(vec_sub(s.point, vec_splat(w.view->eye)), vec_splat(w.view->axis));
    s.normal = e.normal;
    s.smooth = pick(e.on_plane, e.value, e.value * (real)(w.settings->value_scale) + (real)(w.settings->value_offset));
    s.steps = looked;
    *steps += looked;
#if PLANES > 0 && SURFACE
    const real distance = pick(s.hit, e.t, (real)(REAL_LARGEST));
    s = planes_into(s, e.light, background, planes_seen(r, distance, wanted, w.planes), w.view);
#endif
    return s;
}
