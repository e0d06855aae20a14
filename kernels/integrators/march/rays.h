// What a march is after, and what it finds.
#include "integrators/camera.h"
#include "integrators/march/waits.h"

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
    return (crossing){less(R(1.0), R(0.0)), t, t, (real)(REAL_LARGEST), R(0.0), R(0.0), R(0.0)};
}

INLINE crossing crossing_pick(mask m, crossing yes, crossing no) {
    return (crossing){(m & yes.hit) | (~m & no.hit), pick(m, yes.t, no.t), pick(m, yes.last, no.last), pick(m, yes.touch, no.touch),
                      pick(m, yes.steps, no.steps), pick(m, yes.count, no.count), pick(m, yes.bad, no.bad)};
}

// What every march begins with: lanes `fresh` take a ray, of which nothing is found yet. The others are given their own again.
#define MARCH_TAKES(m, ray, fresh)                                              \
    (m)->r = ray;                                                               \
    (m)->active |= fresh;                                                       \
    (m)->found = crossing_pick(fresh, nothing_met((ray).near), (m)->found)
// The inside test at the present places of a march.
#define MARCH_TESTS(m, point, here)                                                                 \
    const vec point = vec_along((m)->r.origin, (m)->t, (m)->r.direction);                           \
    const orbit_end here = orbit_solid(point, (m)->active, orbit->iterations, orbit, k);            \
    MARCH_COUNTS(m, here)
#define MARCH_COUNTS(m, here)                                                                       \
    if (settings->counts_waits) (m)->waits += orbit_waits((m)->active, here.count);                 \
    (m)->found.steps += pick((m)->active, R(1.0), R(0.0));                                          \
    (m)->found.count += pick((m)->active, here.count, R(0.0))

// The scaled distance at which light is computed, in cones.
INLINE real near_of(clearance here, march_record settings) {
    return JOINED ? (real)(settings->near) * here.scale / (real)(settings->step_scale) : (real)(settings->near);
}

// The goal of a march (see march.h and march_steps.h).
enum { GOAL_SURFACE, GOAL_SHADOW, GOAL_TOUCH, GOAL_POINT, GOAL_CONE, GOAL_WALK };
