// Rays that wait to be marched, and what they met. Stages that know no formula write rays down; `march.cl`, which knows
// little else, marches them, whatever they are for.
//
// A wave is the pixels of one launch. Each of them may send several rays for one purpose, its turns: turn by turn stands one ray
// of every pixel of the wave. What a ray finds depends on nothing but the ray, so the order of marching is free.
#include "memory.h"

// What a ray met.
typedef struct {
    real hit;                      // 1 or 0
    real steps, count, t, bad;     // as a crossing's ...
    real touch, last;              // ... and of a surface: where it is shaded, for one
    vec normal;                    // of a surface: towards the viewer, length 1 ...
    real smooth;                   // ... its escape count ...
    real more_steps, more_count;   // ... and what finding these has cost
#if SOLIDS > 1
    real solid;                     // the number of the object that the surface belongs to, or 0
#endif
#if JOINS_SMOOTHLY
    real other, share;              // where two flow together: likewise of the other one, and its part of the colour
#endif
} encounter;

// Places of numbers in these structs.
#define RAY_NEAR 6
#define RAY_FAR 7
#define RAY_NUMBERS NUMBERS_OF(ray)
// Beside a ray stands one number more: of a ray of ambient light the weight of what it brings; of one that looks for a surface
// where it began before a cone took it farther.
#define RAY_STRENGTH NUMBERS_OF(ray)
#define RAY_START NUMBERS_OF(ray)
// With objects two more: how far the first one on the ray is, or the largest number; and which one, see objects.h.
#define RAY_OBJECT (NUMBERS_OF(ray) + 1)
#define RAY_OBJECT_NUMBER (NUMBERS_OF(ray) + 2)
#define ENCOUNTER_STEPS 1
#define ENCOUNTER_COUNT 2
#define ENCOUNTER_T 3
#define ENCOUNTER_SURFACE 3
#define ENCOUNTER_NORMAL 7  // what a march finds itself ends there
// What is found of a shadow: not how often a march was surprised.
#define SHADOW_NUMBERS 4

typedef struct {
    __global scalar *rays, *met;
    int wave, turns;   // pixels of the wave, and rays of each that were marched
    int stride;        // from one number of a ray to its next
} queue;

// Sends one ray of each pixel of a packet, whose first pixel is number `first` of the wave. Those that are not wanted have no
// length: nobody marches them, and they meet nothing.
INLINE void queue_send(queue q, int turn, int first, ray r, mask wanted) {
    r.far = pick(wanted, r.far, R(-1.0));
    numbers_keep((const real *)&r, RAY_NUMBERS, q.rays + turn * q.wave + first, q.stride);
}

// Sends none for any pixel of a packet.
INLINE void queue_skip(queue q, int turn, int first) {
    __global scalar *at = q.rays + turn * q.wave + first;
    lanes_store(R(0.0), at + RAY_NEAR * q.stride);
    lanes_store(R(-1.0), at + RAY_FAR * q.stride);
#if HAS_OBJECTS
    lanes_store((real)(REAL_LARGEST), at + RAY_OBJECT * q.stride);
#endif
}

INLINE ray queue_ray(queue q, int turn, int first) {
    ray r;
    r.known = RAY_NOTHING_KNOWN;
    numbers_recall((real *)&r, RAY_NUMBERS, q.rays + turn * q.wave + first, q.stride);
    return r;
}

INLINE encounter queue_met(queue q, int turn, int first) {
    encounter e;
    RECALL(e, q.met + turn * q.wave + first, q.stride);
    const ray r = queue_ray(q, turn, first);
    const mask sent = less(r.near, r.far);
    // What nobody has written may be any bits, and lanes are not quite alone: some functions of the libraries take another way for
    // all of them where one has a large argument.
    const mask lands = sent & mask_of(e.hit);
    real *numbers = (real *)&e;
#define WRITTEN_NUMBER(i) numbers[i] = pick(i < ENCOUNTER_NORMAL ? sent : lands, numbers[i], R(0.0));
    WRITTEN_OUT(NUMBERS_OF(encounter), WRITTEN_NUMBER)
#if HAS_OBJECTS
    const real object = lanes_load(q.rays + RAY_OBJECT * q.stride + turn * q.wave + first);
    const mask nearer = less(object, pick(mask_of(e.hit), e.t, (real)(REAL_LARGEST)));
    e.hit = pick(nearer, R(1.0), e.hit);
    e.t = pick(nearer, object, e.t);
#endif
    return e;
}

#if HAS_OBJECTS
// The object that a ray has met, or 0.
INLINE real queue_object(queue q, int turn, int first, encounter met) {
    __global const scalar *at = q.rays + turn * q.wave + first;
    const mask here = mask_of(met.hit) & equal(met.t, lanes_load(at + RAY_OBJECT * q.stride));
    return pick(here, lanes_load(at + RAY_OBJECT_NUMBER * q.stride), R(0.0));
}
#endif
