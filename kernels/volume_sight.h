// What a ray from the eye sees of a grid, and of the quads between.
#define HALVINGS 5   // of the step that met the surface

// What is seen along a ray so far: light, and the part of what comes next that gets through; and the place where half of the
// light is stopped, with the value there (on a plane the count), which is what the data channels tell.
typedef struct {
    color light;
    real through, t, value;
    vec normal;
    mask found, on_plane, middle_way;   // the last: where it was met by what came last
} sight;

// A place with the given `opacity` becomes visible; returns the part of its own light that reaches the eye.
INLINE real sight_pass(sight *s, real opacity, real t, real value, mask adds) {
    const real weight = pick(adds, s->through * opacity, R(0.0));
    s->through = pick(adds, s->through * (R(1.0) - opacity), s->through);
    const mask middle_way = adds & ~s->found & less_equal(s->through, R(0.5));
    s->t = pick(middle_way, t, s->t);
    s->value = pick(middle_way, value, s->value);
    s->found |= middle_way;
    s->middle_way = middle_way;
    return weight;
}

// The same, with the place's light and normal.
INLINE void sight_add(sight *s, color light, real opacity, real t, real value, vec normal, mask of_plane, mask adds) {
    const real weight = sight_pass(s, opacity, t, value, adds);
    s->light = color_pick(adds, color_add(s->light, color_scale(light, weight)), s->light);
    s->normal = vec_pick(s->middle_way, normal, s->normal);
    s->on_plane |= s->middle_way & of_plane;
}

// The quads in the picture that are still ahead of a ray; where a surface is shown they are added after it.
#if PLANES > 0 && !SURFACE
typedef struct {
    plane_hits hits;
    plane_hit next;
} quads;

INLINE quads quads_ahead(ray r, mask wanted, world w) {
    quads q;
    q.hits = planes_met(r, wanted, w.planes);
    q.next = planes_next(&q.hits, R(-1.0), R(-1.0), w.planes);
    return q;
}

// Adds those that are left before distance `until`, one after the other.
INLINE void sight_quads(sight *s, real until, mask active, quads *q, world w) {
    for (int i = 0; i < PLANES; ++i) {
        const mask here = active & less(q->next.distance, until);
        if (!any_lane(here)) return;
        sight_add(s, q->next.tint, q->next.alpha, q->next.distance, q->next.count, q->next.normal, here, here);
        q->next = planes_next(&q->hits, pick(here, q->next.distance, q->next.before), pick(here, q->next.index, q->next.after), w.planes);
    }
}
#else
typedef struct {
    int none;
} quads;

INLINE quads quads_ahead(ray r, mask wanted, world w) {
    const quads q = {0};
    return q;
}

INLINE void sight_quads(sight *s, real until, mask active, quads *q, world w) {}
#endif

#if SURFACE
// Steps to the first place above the level, and back to where it is passed.
INLINE mask surface_met(grid_ray g, mask active, world w, real *at, real *looked) {
    mask found = active & ~active;
    real number = R(0.0);
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (!any_lane(active)) break;
        cell c;
        ints entry;
        real onward;
        const mask seen = look(g, number, &active, w, &c, &entry, &onward, looked);
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
        const cell c = cell_at(place_of(g, middle), w.grid.about);
        const ints entry = brick_at(c, w.grid);
        const mask stored = found & is_stored(entry);
        const mask inside = stored & less_equal((real)(w.settings->level), grid_value(c, entry, stored, w.grid));
        high = pick(inside, middle, high);
        low = pick(inside, low, middle);
    }
    *at = high;
    return found;
}

// What a ray from the eye sees of the grid.
INLINE void sight_grid(sight *e, ray r, grid_ray g, mask active, vec to_viewer, quads *q, world w, real *looked) {
    real at;
    const mask found = surface_met(g, active, w, &at, looked);
    if (!any_lane(found)) return;
    const cell c = cell_at(place_of(g, at), w.grid.about);
    const ints entry = brick_at(c, w.grid);
    const mask stored = found & is_stored(entry);
    const real t = distance_of(g, at, w);
    const vec point = vec_along(r.origin, t, r.direction);
    vec normal = grid_normal(c, entry, stored, w.grid);
    const mask none = less(vec_dot(normal, normal), R(0.5));
    // A ray that begins inside, at the grid's side, meets a flat face.
    normal = vec_pick(none, to_viewer, normal_there(point, normal, found & ~none, w));
    const real value = pick(stored, grid_value(c, entry, stored, w.grid), R(0.0));
    const color light = lit(point, normal, tint_of(value, normal, w), to_viewer, found, w, looked);
    sight_add(e, light, R(1.0), t, value, normal, found & ~found, found);
}
#else
// Light is the costly part: places are kept until a lane has PENDING of them, and lit together. One lane has no neighbours to wait
// for, and needs no array.
#define PENDING (LANES == 1 ? 1 : 4)
typedef struct {
    real number, value, weight;
} pending;
typedef struct {
    pending places[PENDING];
    real count, half_number;   // of them; the place where half of the light is stopped
    color sum;                 // the light of those before
} unlit;

INLINE void unlit_add(unlit *u, real number, real value, real weight, mask middle_way, mask adds) {
    for (int k = 0; k < TURNS(PENDING); ++k) {
        const mask here = adds & equal(u->count, (real)((scalar)k));
        u->places[k].number = pick(here, number, u->places[k].number);
        u->places[k].value = pick(here, value, u->places[k].value);
        u->places[k].weight = pick(here, weight, u->places[k].weight);
    }
    u->count += pick(adds, R(1.0), R(0.0));
    u->half_number = pick(middle_way, number, u->half_number);
}

INLINE void unlit_light(unlit *u, sight *e, ray r, grid_ray g, vec to_viewer, world w, real *looked) {
    for (int k = 0; k < TURNS(PENDING); ++k) {
        const mask lit_here = less((real)((scalar)k), u->count);
        if (!any_lane(lit_here)) break;
        const real at = u->places[k].number;
        const cell c = cell_at(place_of(g, at), w.grid.about);
        const vec normal = facing_normal(grid_normal(c, brick_at(c, w.grid), lit_here, w.grid), to_viewer);
        const color light = lit(vec_along(r.origin, distance_of(g, at, w), r.direction), normal,
                                tint_of(u->places[k].value, normal, w), to_viewer, lit_here, w, looked);
        u->sum = color_pick(lit_here, color_add(u->sum, color_scale(light, u->places[k].weight)), u->sum);
        e->normal = vec_pick(lit_here & equal(at, u->half_number), normal, e->normal);
    }
    u->count = R(0.0);
}

// One place further; the lanes through which no light gets any more are active no longer.
INLINE mask sight_step(sight *e, unlit *u, grid_ray g, mask active, real *number, quads *q, world w, real *looked) {
    cell c;
    ints entry;
    real onward;
    const mask seen = look(g, *number, &active, w, &c, &entry, &onward, looked);
    if (any_lane(seen)) {
        const real value = grid_value(c, entry, seen, w.grid), opacity = opacity_of(value, w);
        const mask adds = seen & less(R(0.0), opacity);
        onward = pick(seen, *number + R(1.0), onward);
#if HAS_EMISSION
        sight_quads(e, distance_of(g, *number, w), seen, q, w);
        e->light = color_pick(seen, color_add(e->light, color_scale(emission_of(value, w), e->through)), e->light);
#endif
        if (any_lane(adds)) {
            const real t = distance_of(g, *number, w);
            sight_quads(e, t, adds, q, w);
            const real weight = sight_pass(e, opacity, t, value, adds);
            unlit_add(u, *number, value, weight, e->middle_way, adds);
            active &= less(R(1.0) - (real)(w.settings->opacity_limit), e->through);
        }
    }
    *number = onward;
    return active;
}

// What a ray from the eye sees of the grid.
INLINE void sight_grid(sight *e, ray r, grid_ray g, mask active, vec to_viewer, quads *q, world w, real *looked) {
    unlit u;
    for (int k = 0; k < TURNS(PENDING); ++k) u.places[k].number = u.places[k].value = u.places[k].weight = R(0.0);
    u.count = R(0.0);
    u.half_number = R(-1.0);
    u.sum = color_of(R(0.0), R(0.0), R(0.0));
    real number = R(0.0);
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (any_lane(active)) active = sight_step(e, &u, g, active, &number, q, w, looked);
        if (any_lane(active) && !any_lane(less_equal((real)((scalar)PENDING), u.count))) continue;
        unlit_light(&u, e, r, g, to_viewer, w, looked);
        if (!any_lane(active)) break;
    }
    e->light = color_add(e->light, u.sum);
}
#endif
