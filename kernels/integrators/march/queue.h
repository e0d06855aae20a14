// Rays that wait to be marched, and what they met. Stages that know no formula write rays down; `march.cl`, which knows
// little else, marches them, whatever they are for.
//
// A wave is the pixels of one launch. Each of them may send several rays for one purpose, its turns: turn by turn stands one ray
// of every pixel of the wave. What a ray finds depends on nothing but the ray, so the order of marching is free.
#include "device/memory.h"

// What a ray met.
typedef struct {
    real hit;                      // 1 or 0
    real steps, count, t, bad;     // as a crossing's ...
    real touch, last;              // ... and of a surface: where it is shaded, for one
    vec normal;                    // of a surface: towards the viewer, length 1 ...
    real smooth;                   // ... its escape count ...
    real more_steps, more_count;   // ... and what finding these has cost
    real solid;                    // the number of the object that the surface belongs to, or 0
    real other, part;              // where two flow together: likewise of the other one, and its part of the colour
} ray_hit;
NUMBERS_PICKED(ray_hit)

// Places of numbers in these structs.
#define RAY_NEAR 6
#define RAY_FAR 7
#define RAY_SENT (NUMBERS_OF(ray) - 1)
#define RAY_KNOWN RAY_SENT   // only where pixels have points
// Beside a ray stands one number more: of a ray of ambient light or from fog the weight of what it brings; of one that looks for a surface
// where it began before a cone took it farther.
#define RAY_STRENGTH NUMBERS_OF(ray)
#define RAY_START NUMBERS_OF(ray)
// With objects beside the set five more: how far the first one on the ray is, or the largest number; which one, or 0, see objects.h; and
// where it is shaded. Until objects are met: how long the ray may be, below 0 where it is not wanted; OBJECT_AWAITED; and at what
// distance an object is near enough for nothing else to matter.
#define RAY_OBJECT (NUMBERS_OF(ray) + 1)
#define RAY_OBJECT_NUMBER (NUMBERS_OF(ray) + 2)
#define RAY_OBJECT_PLACE (NUMBERS_OF(ray) + 3)
#define OBJECT_AWAITED R(-1.0)
#define ENCOUNTER_STEPS 1
#define ENCOUNTER_COUNT 2
#define ENCOUNTER_T 3
#define ENCOUNTER_SURFACE 3
#define ENCOUNTER_NORMAL 7  // what a march finds itself ends there
#define ENCOUNTER_SOLID 13  // from here on only where solids are joined, and then where they are joined smoothly
#define ENCOUNTER_OTHER 14
// What is found of a shadow: not how often a march was surprised.
#define SHADOW_NUMBERS 4

typedef struct {
    __global scalar *rays, *met;
    int wave, turns;   // pixels of the wave, and rays of each that were marched
    int stride;        // from one number of a ray to its next
    int numbers;       // that are kept of what a ray met
    int objects;       // whether rays meet objects beside the set, too
    int known;         // whether something is known of rays
    lane_places lanes; // where the packet's pixels stand
} queue;

// Sends one ray of each pixel of a packet, whose first pixel is number `first` of the wave. Those that are not wanted have no
// length: nobody marches them, and they meet nothing.
INLINE void queue_send(queue q, int turn, int first, ray r, mask wanted) {
    r.far = pick(wanted, r.far, R(-1.0));
    __global scalar *at = q.rays + turn * q.wave + first;
    KEEP_NUMBERS_AT((const real *)&r, RAY_SENT, at, q.stride, q.lanes);
    if (q.known) lanes_store_at(r.known, at + RAY_KNOWN * q.stride, &q.lanes);
}

// Sends none for any pixel of a packet.
INLINE void queue_skip(queue q, int turn, int first) {
    __global scalar *at = q.rays + turn * q.wave + first;
    lanes_store(R(0.0), at + RAY_NEAR * q.stride);
    lanes_store(R(-1.0), at + RAY_FAR * q.stride);
    if (!q.objects) return;
    lanes_store((real)(REAL_LARGEST), at + RAY_OBJECT * q.stride);
    lanes_store(R(0.0), at + RAY_OBJECT_NUMBER * q.stride);
}

INLINE ray queue_ray(queue q, int turn, int first) {
    ray r;
    r.known = RAY_NOTHING_KNOWN;
    __global const scalar *at = q.rays + turn * q.wave + first;
    RECALL_NUMBERS_AT((real *)&r, RAY_SENT, at, q.stride, q.lanes);
    if (q.known) r.known = lanes_load_at(at + RAY_KNOWN * q.stride, &q.lanes);
    return r;
}

// What is kept of it; lanes that have met nothing hold anything.
INLINE ray_hit ray_hit_kept(queue q, int at) {
    ray_hit e = {0};
    RECALL_NUMBERS((real *)&e, ENCOUNTER_SOLID, q.met + at, q.stride);
    if (q.numbers > ENCOUNTER_SOLID) e.solid = lanes_load(q.met + ENCOUNTER_SOLID * q.stride + at);
    if (q.numbers > ENCOUNTER_OTHER) {
        e.other = lanes_load(q.met + ENCOUNTER_OTHER * q.stride + at);
        e.part = lanes_load(q.met + (ENCOUNTER_OTHER + 1) * q.stride + at);
    }
    return e;
}

// Keeps what has been found out about a surface.
INLINE void ray_hit_keep_surface(queue q, int at, const ray_hit *e) {
    KEEP_NUMBERS((const real *)e + ENCOUNTER_SURFACE, ENCOUNTER_SOLID - ENCOUNTER_SURFACE, q.met + ENCOUNTER_SURFACE * q.stride + at, q.stride);
    if (q.numbers > ENCOUNTER_SOLID) lanes_store(e->solid, q.met + ENCOUNTER_SOLID * q.stride + at);
    if (q.numbers > ENCOUNTER_OTHER) {
        lanes_store(e->other, q.met + ENCOUNTER_OTHER * q.stride + at);
        lanes_store(e->part, q.met + (ENCOUNTER_OTHER + 1) * q.stride + at);
    }
}

INLINE ray_hit queue_met(queue q, int turn, int first) {
    const int at = turn * q.wave + first;
    ray_hit e = ray_hit_kept(q, at);
    const mask sent = less(lanes_load(q.rays + RAY_NEAR * q.stride + at), lanes_load(q.rays + RAY_FAR * q.stride + at));
    mask nearer = sent & ~sent;
    real object = R(0.0);
    if (q.objects) {
        object = lanes_load(q.rays + RAY_OBJECT * q.stride + at);
        nearer = less(object, pick(sent & mask_of(e.hit), e.t, (real)(REAL_LARGEST)));
    }
    // What nobody has written may be any bits, and lanes are not quite alone: some functions of the libraries take another way for
    // all of them where one has a large argument.
    const mask lands = (sent & mask_of(e.hit)) | nearer;
    real *numbers = (real *)&e;
#define WRITTEN_NUMBER(i) numbers[i] = pick(i < ENCOUNTER_NORMAL ? sent : lands, numbers[i], R(0.0));
    WRITTEN_OUT(NUMBERS_OF(ray_hit), WRITTEN_NUMBER)
    e.hit = pick(nearer, R(1.0), e.hit);
    e.t = pick(nearer, object, e.t);
    e.touch = pick(nearer, object, e.touch);
    e.part = pick(nearer, R(0.0), e.part);
    return e;
}

// The object that a ray has met, or 0.
INLINE real queue_object(queue q, int turn, int first, ray_hit met) {
    if (!q.objects) return R(0.0);
    __global const scalar *at = q.rays + turn * q.wave + first;
    const mask here = mask_of(met.hit) & equal(met.t, lanes_load(at + RAY_OBJECT * q.stride));
    return pick(here, lanes_load(at + RAY_OBJECT_NUMBER * q.stride), R(0.0));
}
