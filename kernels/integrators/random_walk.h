// Random walks within the set: a path goes from scattering to scattering until it is where it leaves the set, or meets an object
// or a light that stands within. All of it counts as one bounce.
//
// A walk begins where the set does: a ray starts where another has met the surface, which may be some footprints before it or a part of
// one in it. So the entrance is looked for on both sides, and halved down to a small part of a free path. Flights from there on are
// tested at their ends, and every step on their way: where a medium is so dense that flights are shorter than steps there is one test
// for each of them. What has been scattered MOST_SCATTERINGS times leaves the set where it came in, so that dense media lose nothing.
#define ENTRANCE_PART R(0.01)   // of a free path that is not known of the entrance
#define ENTRANCE_BACK R(1.0)    // footprints that are looked back for it
#define NEVER_A_SHEET R(-1.0)   // `near` of a ray that is known to have been inside

// What a lane's path carries on its walk, beside its ray.
typedef struct {
    path so_far;
    path_state with;
    vec entrance, back;      // where it came in, and the way out from there
    real stop;               // how far its ray goes: to the end of the flight, or to an object or a light that is nearer ...
    real object, number;     // ... how far the object is, and which one
    real scatterings, draws; // the former below 0 until any place within is known
    mask open;               // whether a place outside, before the entrance, is known
} walk;

#if LANES == 1
#define bits_of_real(a) ((uint)(a))
#else
#define bits_of_real(a) JOIN(convert_uint, LANES)(a)
#endif

// The next number in (0, 1) of lanes `here`. Each lane's numbers depend on nothing but its path.
INLINE real walk_number(walk *a, mask here) {
    const bits seed = bits_of_real(a->with.seed_low) + (bits_of_real(a->with.seed_high) << 16);
    const bits key = bits_of_real(a->draws) * 0x9e3779b9u;
    a->draws += pick(here, R(1.0), R(0.0));
    return unit_of_bits(hash_bits(seed + hash_bits(key)));
}

// Begins a flight along the ray, at its origin.
INLINE void walk_flies(march *m, walk *a, mask here, world w) {
    m->t = pick(here, R(0.0), m->t);
    m->low = pick(here, R(0.0), m->low);
    m->high = pick(here, R(0.0), m->high);
    m->r.near = pick(here, NEVER_A_SHEET, m->r.near);
    real stop = a->with.flight;
    m->r.far = pick(here, stop, m->r.far);
    real number;
    const real met = objects_met(&m->r, w.objects, w.planes, w.settings->object_count, w.tables, &number);
    a->object = pick(here, met, a->object);
    a->number = pick(here, number, a->number);
    stop = fmin(stop, met);
    light_hit_of(m->r.origin, m->r.direction, 0, &stop, w);
    real face;
    stop = fmin(stop, way_to_cut(m->r.origin, m->r.direction, &face, w.planes));
    a->stop = pick(here, stop, a->stop);
    m->r.far = pick(here, (real)(REAL_LARGEST), m->r.far);
}

// Moves the origin of lanes to a place on their rays, where they turn to `direction`.
INLINE void walk_moves(march *m, real t, vec direction, mask here) {
    m->r.origin = vec_pick(here, vec_along(m->r.origin, t, m->r.direction), m->r.origin);
    m->r.direction = vec_pick(here, direction, m->r.direction);
}

// Scatters lanes that are at the end of their flight, and draws the next one.
INLINE void walk_scatters(march *m, walk *a, mask here, int bounce, world w) {
    if (!any_lane(here)) return;
    flight_ends(&a->so_far, &a->with, (real)(REAL_LARGEST), here);
    a->so_far.direction = m->r.direction;
    const real u = walk_number(a, here), v = walk_number(a, here);
    path_turns(&a->so_far, &a->with, u, v, here);
    a->scatterings += pick(here, R(1.0), R(0.0));
    const real chance = walk_number(a, here);
    const mask asked = here & less_equal((real)((scalar)w.settings->roulette), a->scatterings + (real)((scalar)bounce));
    const mask ends = asked & ~path_survives(&a->so_far, chance, asked);
    m->active &= ~ends;
    here &= ~ends;
    const mask enough = here & less_equal((real)((scalar)MOST_SCATTERINGS), a->scatterings);
    walk_moves(m, m->t, a->so_far.direction, here);
    m->r.origin = vec_pick(enough, a->entrance, m->r.origin);
    m->r.direction = vec_pick(enough, a->back, m->r.direction);
    const real choice = walk_number(a, here), way = walk_number(a, here);
    flight_begins(&a->with, a->so_far.through, way, choice, here);
    a->with.flight = pick(enough, (real)(REAL_LARGEST), a->with.flight);
    walk_flies(m, a, here, w);
}

// Lanes that have found the set begin their walk there.
INLINE void walk_enters(march *m, walk *a, mask here, world w) {
    if (!any_lane(here)) return;
    walk_moves(m, m->high, m->r.direction, here);
    a->entrance = vec_pick(here, m->r.origin, a->entrance);
    a->back = vec_pick(here, vec_scale(m->r.direction, R(-1.0)), a->back);
    m->entered |= here;
    walk_flies(m, a, here, w);
}

// One test of the active lanes; those that leave the set, meet what stands in it or end are active no longer.
INLINE void walk_step(march *m, walk *a, int bounce, world w, orbit_record orbit, constants k) {
    march_record settings = w.settings;
    const real step = (real)(settings->step), cone = (real)(settings->detail) * (m->r.footprint + m->r.spread * m->t);
    MARCH_TESTS_BODY(m, point, here, body, in_body);
    // The set ends where its bounds do.
    const vec middle = vec_sub(point, vec_splat(settings->bounds_center));
    const mask within = in_body & less_equal(vec_dot(middle, middle), (real)(settings->bounds_radius * settings->bounds_radius));
    const mask inside = m->active & within, outside = m->active & ~within;
    const real size = fmax(fmax(fabs(point.x), fabs(point.y)), fmax(fabs(point.z), m->t));
    const real least_width = R(2.0) * (real)(REAL_EPSILON) * size, finest = fmax(EXIT_TOLERANCE * cone, least_width);
    // Towards the entrance: outside at `low`, inside at `high`, as far as these are known.
    const mask before = m->active & ~m->entered;
    a->scatterings = pick(before & inside, R(0.0), a->scatterings);
    const mask found = before & (inside | less_equal(R(0.0), a->scatterings));
    const mask sheet = march_misses(m, outside & ~found, cone), placed = march_places(m, inside, outside);
    m->high = pick(before & inside, m->t, m->high);
    m->low = pick(before & outside, m->t, m->low);
    a->open |= before & outside;
    const real free_path = R(1.0) / fmax(brightest(a->with.extinction), R(1e-20));
    const mask narrow = a->open & less_equal(m->high - m->low, fmax(fmin(finest, ENTRANCE_PART * free_path), least_width));
    const mask deep = found & ~a->open & less(ENTRANCE_BACK * cone, m->r.near - m->high), starts = (found & narrow) | deep;
    m->high = pick(deep, m->r.near, m->high);

    // Within: towards the exit, or to the end of the flight.
    const mask searching = m->active & m->entered & ~m->narrow;
    const mask stops = searching & inside & ~m->left & less_equal(a->stop, m->t);
    march_narrows(m, inside, outside, searching, body, finest, (real)(settings->near) * cone);
    mask met;
    const real free = march_to_walls(m, point, searching & inside & ~m->left & ~stops, cone, &met, settings, orbit, k);
    const mask done = sheet | placed | met | march_at_walls(m), scatters = stops & less_equal(a->with.flight, a->stop);
    m->found.hit |= done;
    m->active &= ~done & ~(stops & ~scatters);

    const real entrance = fmax(ENTRANCE_START * cone, ENTRANCE_GROWTH * (m->t - m->r.near));
    const real back = m->high - fmax(ENTRANCE_START * cone, m->r.near - m->high);
    const real toward_set = pick(found, pick(a->open, R(0.5) * (m->low + m->high), back), m->t + fmin(entrance, step));
    m->t = pick(before, toward_set, march_goes_to(m, fmin(m->t + fmin(step, free), a->stop)));
    walk_enters(m, a, starts, w);
    walk_scatters(m, a, scatters, bounce, w);
    m->t = pick(starts | scatters, fmin(step, a->stop), m->t);
    m->active &= less(m->t, (real)(REAL_LARGEST));   // no path goes on at a place that is no number
}

// Numbers of a struct between a lane and the place of its ray among those of the wave, for lanes given as bits.
INLINE void lanes_take(real *number, __global const scalar *from, const int *places, uint here) {
    scalar each[LANES];
    lanes_store(*number, each);
    while (here != 0) {
        const int lane = highest_bit(here);
        here ^= 1u << lane;
        each[lane] = from[places[lane]];
    }
    *number = lanes_load(each);
}

INLINE void lanes_put(real number, __global scalar *to, const int *places, uint here) {
    scalar each[LANES];
    lanes_store(number, each);
    while (here != 0) {
        const int lane = highest_bit(here);
        here ^= 1u << lane;
        to[places[lane]] = each[lane];
    }
}

// Lanes that have taken new rays take the paths of these.
INLINE void walk_takes(walk *a, const int *places, uint fresh, __global const scalar *state, __constant const int *at, int stride) {
    if (fresh == 0) return;
#define TAKE_OF_PATH(i) lanes_take((real *)&a->so_far + i, state + (at[STATE_PATH] + i) * stride, places, fresh);
    WRITTEN_OUT(NUMBERS_OF(path), TAKE_OF_PATH)
#define TAKE_OF_PATH_STATE(i) lanes_take((real *)&a->with + i, state + path_state_number(at, i) * stride, places, fresh);
    WRITTEN_OUT(NUMBERS_OF(path_state), TAKE_OF_PATH_STATE)
    const mask here = lanes_of_bits(fresh);
    a->scatterings = pick(here, R(-1.0), a->scatterings);
    a->open &= ~here;
    a->draws = pick(here, R(0.0), a->draws);
    a->object = pick(here, (real)(REAL_LARGEST), a->object);
}

// Lanes whose walks have ended put their paths down, as they set out last: nothing scatters them before what they meet.
INLINE void walk_puts(const march *m, const walk *a, const int *places, uint ended, queue q, __global scalar *state, __constant const int *at,
                      int stride) {
    if (ended == 0) return;
    path so_far = a->so_far;
    so_far.origin = m->r.origin;
    so_far.direction = m->r.direction;
#define PUT_OF_PATH(i) lanes_put(((const real *)&so_far)[i], state + (at[STATE_PATH] + i) * stride, places, ended);
    WRITTEN_OUT(NUMBERS_OF(path), PUT_OF_PATH)
    const int flight = path_state_number(at, (int)(&a->with.flight - (real *)&a->with));
    lanes_put((real)(REAL_LARGEST), state + flight * stride, places, ended);
#define PUT_OF_RAY(i) lanes_put(((const real *)&m->r)[i], q.rays + i * q.stride, places, ended);
    WRITTEN_OUT(RAY_FAR + 1, PUT_OF_RAY)
    if (!q.objects) return;
    lanes_put(a->object, q.rays + RAY_OBJECT * q.stride, places, ended);
    lanes_put(a->number, q.rays + RAY_OBJECT_NUMBER * q.stride, places, ended);
}

// Walks the paths of a share of the queue; the result is how long lanes have waited.
INLINE lane_waits walk_share(share mine, queue q, __global scalar *state, int stride, int bounce, world w, orbit_record orbit,
                      constants k) {
    share left = mine;
    march m = {0};
    walk a = {0};
    int places[LANES];
    lanes_begin(&m, places);
    for (int waits = 0;;) {
        const uint waiting = lanes_waiting(&m, &left, places, q, GOAL_WALK, w.settings);
        if (waiting == ALL_LANES) return (lane_waits){waits, march_waited(&m, w.settings)};
        waits += bits_count(waiting);
        walk_takes(&a, places, lanes_bits(m.active & equal(m.found.steps, R(0.0))), state, w.settings->state_at, stride);
        const mask before = m.active;
        walk_step(&m, &a, bounce, w, orbit, k);
        walk_puts(&m, &a, places, lanes_bits(before & ~m.active), q, state, w.settings->state_at, stride);
    }
}
