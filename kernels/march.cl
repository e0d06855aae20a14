// Entry points that know the formula: rays of a queue are marched, whatever they are for, and the surfaces that they met are
// looked at. Compiled once for each formula and search.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "rays.h"
#if SEARCH == SEARCH_STEPS
#include "march_steps.h"
#else
#include "march_state.h"
#include "proof.h"
#include "march.h"
#endif
#include "queue.h"
#include "arguments.h"
#include "surface_at.h"

// Idle lanes that are worth a pause for new rays. The steps of the search by steps are too cheap, and those of neighbours too alike.
#define REFILL (SEARCH == SEARCH_STEPS ? LANES : LANES >= 16 ? 2 : 1)

// The rays that one work-item marches: `next`, and every one that is `hop` further, before `end`.
typedef struct {
    int next, end, hop;
} slice_left;

// Lanes that are done put down what they found, and take the next rays. `places`: the number of each lane's ray, or -1.
INLINE void lanes_refill(march *m, slice_left *left, int *places, queue q, int goal, __constant const struct March *settings) {
    scalar busy[LANES], starts[LANES], found[ENCOUNTER_NORMAL][LANES], rays[RAY_NUMBERS][LANES];
    const encounter now = encounter_of(m->found);
    for (int i = 0; i < ENCOUNTER_NORMAL; ++i) lanes_store(((const real *)&now)[i], found[i]);
    for (int i = 0; i < RAY_NUMBERS; ++i) lanes_store(((const real *)&m->r)[i], rays[i]);
    lanes_store(number_of(m->active), busy);
    const int count = goal == GOAL_SHADOW || goal == GOAL_CONE ? SHADOW_NUMBERS : ENCOUNTER_NORMAL;
    __global const scalar *near = q.rays + RAY_NEAR * q.stride, *far = q.rays + RAY_FAR * q.stride;
    for (int lane = 0; lane < LANES; ++lane) {
        starts[lane] = S(0.0);
        if (busy[lane] > S(0.0)) continue;
        if (places[lane] >= 0) {
            for (int i = 0; i < count; ++i) q.met[i * q.stride + places[lane]] = found[i][lane];
        }
        places[lane] = -1;
        while (left->next < left->end && !(near[left->next] < far[left->next])) left->next += left->hop;
        if (left->next >= left->end) continue;
        for (int i = 0; i < RAY_NUMBERS; ++i) rays[i][lane] = q.rays[i * q.stride + left->next];
        places[lane] = left->next;
        left->next += left->hop;
        starts[lane] = S(1.0);
    }
    ray fresh;
    fresh.known = RAY_NOTHING_KNOWN;
    for (int i = 0; i < RAY_NUMBERS; ++i) ((real *)&fresh)[i] = lanes_load(rays[i]);
    march_begin(m, fresh, mask_of(lanes_load(starts)), goal, settings);
}

// Looks at the surfaces that the rays of a queue from number `at` on have met: normals and escape counts, and with POLISH where
// exactly they are.
INLINE void look_at(queue q, int at, __constant const struct March *settings, __constant const struct Orbit *orbit,
                    __constant const scalar *k) {
    encounter e = queue_met(q, 0, at);
    const mask hit = mask_of(e.hit);
    if (!any_lane(hit)) return;
    surface_at(queue_ray(q, 0, at), &e, hit, settings, orbit, k);
    numbers_keep((const real *)&e + ENCOUNTER_SURFACE, NUMBERS_OF(encounter) - ENCOUNTER_SURFACE,
                 q.met + ENCOUNTER_SURFACE * q.stride + at, q.stride);
}

// Marches all rays of a queue, each work-item some: a packet's lanes share `slice` rays in a row, and a lane that is done
// takes the next of them; single lanes take rays that are far apart, so that neighbours read neighbouring memory.
STAGE(march_rays) {
    const queue q = STAGE_QUEUE;
    const int total = q.turns * q.wave, begin = LANES == 1 ? ITEM : ITEM * slice;
    if (begin >= total || WAS_CANCELLED) return;
    slice_left left = {begin, LANES == 1 ? total : min(begin + slice, total), LANES == 1 ? (int)get_global_size(0) : 1};
    march m = {0};
    int held[LANES];
    for (int lane = 0; lane < LANES; ++lane) held[lane] = -1;
    int waits = 0;
    for (;;) {
        const int idle = lanes_count(~m.active);
        if (idle == LANES || (idle >= REFILL && left.next < left.end)) {
            lanes_refill(&m, &left, held, q, goal, settings);
            if (!any_lane(m.active)) break;
        }
        waits += LANES - lanes_count(m.active);
        march_step(&m, goal, settings, orbit, k);
    }
    // A single lane looks in a kernel of its own, which leaves it more registers for this one.
    for (int at = begin; LANES > 1 && (goal == GOAL_SURFACE || goal == GOAL_POINT) && at < left.end; at += LANES) {
        look_at(q, at, settings, orbit, k);
    }
    if (LANES > 1) atomic_add(statistics + STATISTICS * (first_tile * (TILE * TILE / LANES) + first_packet) + STATISTIC_WAITS, (uint)waits);
}

#if LANES == 1
STAGE(look_at_surfaces) {
    const queue q = STAGE_QUEUE;
    const int at = ITEM;
    if (at < q.turns * q.wave && !WAS_CANCELLED) look_at(q, at, settings, orbit, k);
}
#endif
