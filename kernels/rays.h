#include "camera.h"

// A march by the Jacobian already knows the surface's normal when it arrives.
#define MARCH_KEEPS_SURFACE (SEARCH == SEARCH_DISTANCE && !HAS_DERIVATIVE && !POLISH)

// The result of a march.
typedef struct {
    mask hit;
    real t;       // distance along the ray; of a hit, a point still outside the solid
    real steps;   // points of the ray that were tried
    real count;   // formula applications of all of them
    real bad;     // steps that the distance called safe and that ended inside
#if MARCH_KEEPS_SURFACE
    surface_point end_surface;  // at t, with the applications there; a gradient of 0 if t was never seen from outside
    real end_count;
#endif
} crossing;

INLINE crossing nothing_met(real t) {
    crossing c;
    c.hit = less(R(1.0), R(0.0));
    c.t = t;
    c.steps = R(0.0);
    c.count = R(0.0);
    c.bad = R(0.0);
#if MARCH_KEEPS_SURFACE
    c.end_surface.gradient = vec_of(R(0.0), R(0.0), R(0.0));
    c.end_surface.square = R(1.0);
    c.end_surface.square_before = R(1.0);
    c.end_count = R(0.0);
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
    c.steps = pick(m, yes.steps, no.steps);
    c.count = pick(m, yes.count, no.count);
    c.bad = pick(m, yes.bad, no.bad);
#if MARCH_KEEPS_SURFACE
    c.end_surface.gradient = vec_pick(m, yes.end_surface.gradient, no.end_surface.gradient);
    c.end_surface.square = pick(m, yes.end_surface.square, no.end_surface.square);
    c.end_surface.square_before = pick(m, yes.end_surface.square_before, no.end_surface.square_before);
    c.end_count = pick(m, yes.end_count, no.end_count);
#endif
    return c;
}

// The goal of a march (see march.h and march_steps.h).
#define GOAL_SURFACE 0
#define GOAL_SHADOW 1
#define GOAL_TOUCH 2
#define GOAL_POINT 3
