#include "camera.h"

// The result of a march.
typedef struct {
    mask hit;
    real t;       // distance along the ray
    real last;    // of a hit: the last point outside
    real touch;   // where the cone came near the solid; beyond all if it never did
    real steps;   // points of the ray that were tried
    real count;   // formula applications of all of them
    real bad;     // steps that the distance called safe and that ended inside
} crossing;

INLINE crossing nothing_met(real t) {
    crossing c;
    c.hit = less(R(1.0), R(0.0));
    c.t = t;
    c.last = t;
    c.touch = (real)(REAL_LARGEST);
    c.steps = R(0.0);
    c.count = R(0.0);
    c.bad = R(0.0);
    return c;
}

INLINE ray ray_pick(mask m, ray yes, ray no) {
    const ray r = {vec_pick(m, yes.origin, no.origin), vec_pick(m, yes.direction, no.direction), pick(m, yes.near, no.near),
                   pick(m, yes.far, no.far), pick(m, yes.footprint, no.footprint), pick(m, yes.spread, no.spread),
                   pick(m, yes.known, no.known)};
    return r;
}

INLINE crossing crossing_pick(mask m, crossing yes, crossing no) {
    crossing c;
    c.hit = (m & yes.hit) | (~m & no.hit);
    c.t = pick(m, yes.t, no.t);
    c.last = pick(m, yes.last, no.last);
    c.touch = pick(m, yes.touch, no.touch);
    c.steps = pick(m, yes.steps, no.steps);
    c.count = pick(m, yes.count, no.count);
    c.bad = pick(m, yes.bad, no.bad);
    return c;
}

// The goal of a march (see march.h and march_steps.h).
#define GOAL_SURFACE 0
#define GOAL_SHADOW 1
#define GOAL_TOUCH 2
#define GOAL_POINT 3
#define GOAL_CONE 4
#define GOAL_WALK 5   // see walks.h
