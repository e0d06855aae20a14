// How a work-item marches its share of a queue: its lanes take ray after ray, so that none waits for others.

// From each search: REFILL, idle lanes that are worth a pause for new rays; ABREAST, packets that are marched side by side;
// ORBITS_WAITED, for how many applications lanes have waited in orbits that are left under way.

// For how many applications lanes of a packet have waited in all, if that is counted.
INLINE int march_waited(const march *m, march_record settings) {
    return settings->counts_waits ? (int)lanes_sum(to_reals(m->waits)) + ORBITS_WAITED(m) : 0;
}

// The rays that one work-item marches: `next`, and every one that is `hop` further, before `end`.
typedef struct {
    int next, end, hop;
} share;

// A packet's lanes share `slice` rays in a row; single lanes take rays that are far apart, so that neighbours read neighbouring
// memory.
INLINE share share_of_item(int item, int slice, queue q) {
    const int total = q.turns * q.wave, begin = LANES == 1 ? item : item * slice;
    return (share){begin, LANES == 1 ? total : min(begin + slice, total), LANES == 1 ? (int)get_global_size(0) : 1};
}

// The next ray of a share that is wanted, or -1.
INLINE int share_next(share *left, queue q) {
    __global const scalar *near = q.rays + RAY_NEAR * q.stride, *far = q.rays + RAY_FAR * q.stride;
    while (left->next < left->end && !(near[left->next] < far[left->next])) left->next += left->hop;
    if (left->next >= left->end) return -1;
    const int found = left->next;
    left->next += left->hop;
    return found;
}

// What a march has found, as the stages after it read it.
INLINE ray_hit ray_hit_of(crossing c) {
    const vec none = {R(0.0), R(0.0), R(0.0)};
    return (ray_hit){number_of(c.hit), c.steps, c.count, c.t, c.bad, c.touch, c.last, none, R(0.0), R(0.0), R(0.0), R(0.0), R(0.0), R(0.0)};
}

// Whether a ray was inside at its first look, although a cone had called the way there free: a distance can be too large for all the
// cone's width. It then begins anew where it would have begun without the cone.
INLINE int begins_anew(scalar hit, scalar steps, int number, queue q, int goal) {
    if (goal == GOAL_SHADOW || goal == GOAL_CONE || hit == S(0.0) || steps > S(1.0)) return 0;
    __global scalar *near = q.rays + RAY_NEAR * q.stride + number;
    const scalar start = q.rays[RAY_START * q.stride + number];
    if (!(start < *near)) return 0;
    *near = start;
    return 1;
}

// The `idle` lanes put down what they found, and take the next rays, which begin. `places`: the number of each lane's ray, or -1.
INLINE void lanes_refill(march *m, uint idle, share *left, int *places, queue q, int goal, march_record settings) {
    scalar found[ENCOUNTER_NORMAL * LANES];
    const ray_hit now = ray_hit_of(m->found);
#define HOLD_FOUND(i) lanes_store(((const real *)&now)[i], found + i * LANES);
    WRITTEN_OUT(ENCOUNTER_NORMAL, HOLD_FOUND)
    ray next = m->r;
    const int count = goal == GOAL_SHADOW || goal == GOAL_CONE ? SHADOW_NUMBERS : ENCOUNTER_NORMAL;
    uint fresh = 0;
    while (idle != 0) {
        const int lane = highest_bit(idle), done = places[lane];
        const int anew = done >= 0 && begins_anew(found[lane], found[ENCOUNTER_STEPS * LANES + lane], done, q, goal);
        idle ^= 1u << lane;
#define PUT_FOUND(i) if (i < count) q.met[i * q.stride + done] = found[i * LANES + lane];
        if (done >= 0 && !anew) { WRITTEN_OUT(ENCOUNTER_NORMAL, PUT_FOUND) }
        const int next_place = anew ? done : share_next(left, q);
        places[lane] = next_place;
        if (next_place < 0) continue;
        const mask here = lanes_of_bits(1u << lane);
#define TAKE_NUMBER(i) ((real *)&next)[i] = pick(here, (real)(q.rays[i * q.stride + next_place]), ((real *)&next)[i]);
        WRITTEN_OUT(RAY_SENT, TAKE_NUMBER)
        if (q.known) TAKE_NUMBER(RAY_KNOWN)
        fresh |= 1u << lane;
    }
    march_begin(m, next, lanes_of_bits(fresh), goal, settings);
}

INLINE void lanes_begin(march *m, int *places) {
    m->active = less(R(1.0), R(0.0));
    m->r.known = RAY_NOTHING_KNOWN;
    for (int lane = 0; lane < LANES; ++lane) places[lane] = -1;
}

// The lanes that wait in the next step, as bits, after idle ones have taken new rays.
INLINE uint lanes_waiting(march *m, share *left, int *places, queue q, int goal, march_record settings) {
    const uint idle = lanes_bits(~m->active);
    if (idle != ALL_LANES && (bits_count(idle) < REFILL || left->next >= left->end)) return idle;
    lanes_refill(m, idle, left, places, q, goal, settings);
    return lanes_bits(~m->active);
}

// Marches a share of a queue; the result is how long lanes have waited.
INLINE lane_waits march_share(share mine, queue q, int goal, march_record settings, orbit_record orbit, constants k) {
    share left = mine;
    march m = {0};
    int places[LANES];
    lanes_begin(&m, places);
#if ABREAST > 1
    march n = {0};
    int places_n[LANES];
    lanes_begin(&n, places_n);
#endif
    for (int waits = 0;;) {
        uint waiting = lanes_waiting(&m, &left, places, q, goal, settings);
        uint idle = bits_count(waiting);
#if ABREAST > 1
        const uint others = lanes_waiting(&n, &left, places_n, q, goal, settings);
        idle += bits_count(others);
        waiting &= others;
#endif
        if (waiting == ALL_LANES) {
#if ABREAST > 1
            return (lane_waits){waits, march_waited(&m, settings) + march_waited(&n, settings)};
#else
            return (lane_waits){waits, march_waited(&m, settings)};
#endif
        }
        waits += idle;
#if ABREAST > 1
        march_step_both(&m, &n, goal, settings, orbit, k);
#else
        march_step(&m, goal, settings, orbit, k);
#endif
    }
}
