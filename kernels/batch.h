// Rays of a packet's pixels that wait for a lane, and their results. A pixel sends several rays for one purpose: to its
// points, to parts of a light, into the hemisphere. Were they marched turn by turn, all lanes would wait for the slowest pixel
// of each turn (70 % of all lanes with 3 x 3 points); here a lane that is done takes the next ray, whichever pixel sent it.
// What a ray finds depends on nothing but the ray, so the order is free. The steps of the search by steps are too cheap, and
// neighbours' too alike, for it to pay (a quarter slower).
#if SEARCH == SEARCH_DISTANCE && (POINTS > 1 || HAS_AMBIENT || HAS_SOFT_LIGHT)
#define BATCH_TURNS 9
#else
#define BATCH_TURNS 1
#endif

#if BATCH_TURNS == 1
// One ray of each pixel, in the pixel's own lane: no ray waits, and nothing has to be stored.
typedef struct {
    ray r;
    crossing found;
    real strength;
    mask waiting;
} batch;

INLINE void batch_clear(batch *b) { b->strength = R(0.0); }

INLINE void batch_add(batch *b, int turn, ray r, real strength, mask wanted) {
    b->r = r;
    b->strength = strength;
    b->waiting = wanted;
}

INLINE ray batch_ray(const batch *b, int turn) { return b->r; }
INLINE crossing batch_found(const batch *b, int turn) { return b->found; }
INLINE real batch_strength(const batch *b, int turn) { return b->strength; }

INLINE void batch_run(batch *b, int goal, __constant const struct March *settings, __constant const struct Orbit *orbit,
                      __constant const scalar *k) {
    march m = {0};
    march_begin(&m, b->r, b->waiting, goal, settings);
    m.found.t = b->r.near;
    while (any_lane(m.active)) march_step(&m, goal, settings, orbit, k);
    b->found = m.found;
}
#else
#define REFILL (LANES > 2 ? LANES / 2 : 1)   // idle lanes that are worth a pause for new rays
#define BATCH_RAYS (BATCH_TURNS * LANES)
#define RAY_NUMBERS 11
#define CROSSING_NUMBERS (MARCH_KEEPS_SURFACE ? 16 : 7)

typedef struct {
    scalar rays[RAY_NUMBERS][BATCH_RAYS];   // turn by turn, LANES pixels each
    scalar found[CROSSING_NUMBERS][BATCH_RAYS];
    scalar strength[BATCH_RAYS];            // of the light that a ray stands for
    int waiting[BATCH_RAYS];
    int count;                              // of those that wait
} batch;

INLINE void ray_store(ray r, scalar *numbers, int stride) {
    lanes_store(r.origin.x, numbers);
    lanes_store(r.origin.y, numbers + stride);
    lanes_store(r.origin.z, numbers + 2 * stride);
    lanes_store(r.direction.x, numbers + 3 * stride);
    lanes_store(r.direction.y, numbers + 4 * stride);
    lanes_store(r.direction.z, numbers + 5 * stride);
    lanes_store(r.near, numbers + 6 * stride);
    lanes_store(r.far, numbers + 7 * stride);
    lanes_store(r.footprint, numbers + 8 * stride);
    lanes_store(r.spread, numbers + 9 * stride);
    lanes_store(r.known, numbers + 10 * stride);
}

INLINE ray ray_load(const scalar *numbers, int stride) {
    ray r;
    r.origin = vec_of(lanes_load(numbers), lanes_load(numbers + stride), lanes_load(numbers + 2 * stride));
    r.direction = vec_of(lanes_load(numbers + 3 * stride), lanes_load(numbers + 4 * stride), lanes_load(numbers + 5 * stride));
    r.near = lanes_load(numbers + 6 * stride);
    r.far = lanes_load(numbers + 7 * stride);
    r.footprint = lanes_load(numbers + 8 * stride);
    r.spread = lanes_load(numbers + 9 * stride);
    r.known = lanes_load(numbers + 10 * stride);
    return r;
}

INLINE void crossing_store(crossing c, scalar *numbers, int stride) {
    lanes_store(pick(c.hit, R(1.0), R(0.0)), numbers);
    lanes_store(c.t, numbers + stride);
    lanes_store(c.steps, numbers + 2 * stride);
    lanes_store(c.count, numbers + 3 * stride);
    lanes_store(c.bad, numbers + 4 * stride);
    lanes_store(c.touch, numbers + 5 * stride);
    lanes_store(c.last, numbers + 6 * stride);
#if MARCH_KEEPS_SURFACE
    lanes_store(c.gradient.x, numbers + 7 * stride);
    lanes_store(c.gradient.y, numbers + 8 * stride);
    lanes_store(c.gradient.z, numbers + 9 * stride);
    lanes_store(c.near.gradient.x, numbers + 10 * stride);
    lanes_store(c.near.gradient.y, numbers + 11 * stride);
    lanes_store(c.near.gradient.z, numbers + 12 * stride);
    lanes_store(c.near.square, numbers + 13 * stride);
    lanes_store(c.near.square_before, numbers + 14 * stride);
    lanes_store(c.near_count, numbers + 15 * stride);
#endif
}

INLINE crossing crossing_load(const scalar *numbers, int stride) {
    crossing c;
    c.hit = less(R(0.5), lanes_load(numbers));
    c.t = lanes_load(numbers + stride);
    c.steps = lanes_load(numbers + 2 * stride);
    c.count = lanes_load(numbers + 3 * stride);
    c.bad = lanes_load(numbers + 4 * stride);
    c.touch = lanes_load(numbers + 5 * stride);
    c.last = lanes_load(numbers + 6 * stride);
#if MARCH_KEEPS_SURFACE
    c.gradient = vec_of(lanes_load(numbers + 7 * stride), lanes_load(numbers + 8 * stride), lanes_load(numbers + 9 * stride));
    c.near.gradient = vec_of(lanes_load(numbers + 10 * stride), lanes_load(numbers + 11 * stride),
                             lanes_load(numbers + 12 * stride));
    c.near.square = lanes_load(numbers + 13 * stride);
    c.near.square_before = lanes_load(numbers + 14 * stride);
    c.near_count = lanes_load(numbers + 15 * stride);
#endif
    return c;
}

INLINE void batch_clear(batch *b) { b->count = 0; }

// Adds one ray of each pixel; unwanted rays count as having met nothing.
INLINE void batch_add(batch *b, int turn, ray r, real strength, mask wanted) {
    lanes_store(strength, b->strength + turn * LANES);
    ray_store(r, b->rays[0] + turn * LANES, BATCH_RAYS);
    crossing_store(nothing_met(r.near), b->found[0] + turn * LANES, BATCH_RAYS);
    scalar each[LANES];
    lanes_store(pick(wanted, R(1.0), R(0.0)), each);
    for (int lane = 0; lane < LANES; ++lane) {
        if (each[lane] > S(0.0)) b->waiting[b->count++] = turn * LANES + lane;
    }
}

INLINE ray batch_ray(const batch *b, int turn) { return ray_load(b->rays[0] + turn * LANES, BATCH_RAYS); }
INLINE crossing batch_found(const batch *b, int turn) { return crossing_load(b->found[0] + turn * LANES, BATCH_RAYS); }

INLINE real batch_strength(const batch *b, int turn) { return lanes_load(b->strength + turn * LANES); }

// Marches all rays that wait.
INLINE void batch_run(batch *b, int goal, __constant const struct March *settings, __constant const struct Orbit *orbit,
                      __constant const scalar *k) {
    march m = {0};
    scalar rays[RAY_NUMBERS][LANES], found[CROSSING_NUMBERS][LANES], busy[LANES], starts[LANES];
    int place[LANES];   // of each lane's ray in the batch, or -1
    for (int lane = 0; lane < LANES; ++lane) place[lane] = -1;
    int next = 0;
    for (;;) {
        const int idle = lanes_count(~m.active);
        if (idle == LANES || (idle >= REFILL && next < b->count)) {
            crossing_store(m.found, found[0], LANES);
            ray_store(m.r, rays[0], LANES);
            lanes_store(pick(m.active, R(1.0), R(0.0)), busy);
            for (int lane = 0; lane < LANES; ++lane) {
                starts[lane] = S(0.0);
                if (busy[lane] > S(0.0)) continue;
                if (place[lane] >= 0) {
                    for (int i = 0; i < CROSSING_NUMBERS; ++i) b->found[i][place[lane]] = found[i][lane];
                }
                place[lane] = -1;
                if (next == b->count) continue;
                place[lane] = b->waiting[next++];
                for (int i = 0; i < RAY_NUMBERS; ++i) rays[i][lane] = b->rays[i][place[lane]];
                starts[lane] = S(1.0);
            }
            const mask fresh = less(R(0.0), lanes_load(starts));
            if (!any_lane(fresh | m.active)) break;
            march_begin(&m, ray_load(rays[0], LANES), fresh, goal, settings);
        }
        march_step(&m, goal, settings, orbit, k);
    }
}
#endif
