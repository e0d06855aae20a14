#include "camera.h"

// A march by the Jacobian knows gradients where it arrives, but six more numbers would cost a GPU more than to look again at the
// end, and all lane counts have to look the same.
#define MARCH_KEEPS_SURFACE 0

// The result of a march.
typedef struct {
    mask hit;
    real t;       // distance along the ray; of a hit, a point still outside the solid
    real last;    // of a hit: the last point outside
    real touch;   // where the cone came near the solid; beyond all if it never did
    real steps;   // points of the ray that were tried
    real count;   // formula applications of all of them
    real bad;     // steps that the distance called safe and that ended inside
#if MARCH_KEEPS_SURFACE
    vec gradient;        // at the last point outside; 0 if there was none
    surface_point near;  // at the touch, with the applications there
    real near_count;
#endif
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
#if MARCH_KEEPS_SURFACE
    c.gradient = vec_of(R(0.0), R(0.0), R(0.0));
    c.near.gradient = c.gradient;
    c.near.square = R(1.0);
    c.near.square_before = R(1.0);
    c.near_count = R(0.0);
#endif
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
#if MARCH_KEEPS_SURFACE
    c.gradient = vec_pick(m, yes.gradient, no.gradient);
    c.near = surface_pick(m, yes.near, no.near);
    c.near_count = pick(m, yes.near_count, no.near_count);
#endif
    return c;
}

// The goal of a march (see march.h and march_steps.h).
#define GOAL_SURFACE 0
#define GOAL_SHADOW 1
#define GOAL_TOUCH 2
#define GOAL_POINT 3
