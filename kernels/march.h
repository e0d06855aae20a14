// Sphere tracing (Hart 1996) of a packet: steps of the distance to the solid until a ray's pixel cone touches it.

// A distance can be far too small where the map stretches space unevenly, and a cone that touches it is no proof of a
// surface. With the gradient at hand a hit is proved: the touching point descends towards the solid, and counts if it
// arrives within the pixel. Formulas with a scalar rule of their own are nearly conformal and need no proof.
//
// How near counts as arrived depends on the potential G: a low one means that the solid can only be near, though it may be
// as thin as a sheet that no descent finds; where it is high a small estimate is suspect (a valley of G whose steep sides
// pretend to a solid at its bottom), and the descent has to get much nearer.
#define PROOF_STEPS 12
#define PROOF_FACTOR R(2.0)      // first step down, in estimated distances: conformal maps have their solid at one to four
#define PROOF_ARRIVED R(0.0625)  // of the pixel's cone: this near to the solid counts as being there ...
#define PROOF_LANDED R(0.004)    // ... and this near where the potential is high
#define PROOF_LOW R(0.1)         // a low potential: below this part of the cone over the set's radius
#define PROOF_REACH R(1.0)       // of the pixel's cone: how far from the ray the descent may lead
#define PROOF_CREEP R(0.25)      // of the pixel's cone: the least step
#define PROOF_APART R(1.0)       // of the pixel's cone: how far apart two proofs are, unless ...
#define PROOF_CLOSER R(0.7)      // ... the solid is that much nearer than at the failed one
#define PROOF_ONWARD R(0.5)      // of the pixel's cone: the step after a failed proof

#define BACK_STEPS R(4.5)        // a point's evaluations inside, before it counts as hit where it begins

// The march of a packet towards one goal, the same for all lanes:
//   GOAL_SURFACE  the surface: hits are proved, and a step that ended inside is narrowed down to it
//   GOAL_SHADOW   whether anything is in the way: a step that ended inside is a hit
//   GOAL_TOUCH    how far a whole pixel's cone is free: the first proved touch, at a point still outside
typedef struct {
    ray r;
    mask active;
    crossing found;
    real t;
    real low;         // the last point known to be outside
    real high;        // a point known to be inside
    real relaxation, radius_before, step_before;
#if !HAS_DERIVATIVE
    mask proving;
    vec probe, probe_downhill;
    real probe_radius, probes, factor;
    real retry_t, retry_radius;   // the next proof is due from this t on, or below this distance
#endif
} march;

// Lanes `fresh` begin a march along new rays; the others go on with theirs.
INLINE void march_begin(march *m, ray r, mask fresh, int goal, __constant const struct March *settings) {
    m->r = ray_pick(fresh, r, m->r);
    m->active |= fresh;
    m->found = crossing_pick(fresh, nothing_met(r.near), m->found);
    m->t = pick(fresh, r.near, m->t);
    m->low = pick(fresh, r.near, m->low);
    m->high = pick(fresh, (real)(REAL_LARGEST), m->high);
    m->relaxation = pick(fresh, (real)(settings->relaxation), m->relaxation);
    m->radius_before = pick(fresh, (real)(REAL_LARGEST), m->radius_before);
    m->step_before = pick(fresh, R(0.0), m->step_before);
#if !HAS_DERIVATIVE
    m->proving &= ~fresh;
    m->probe = vec_pick(fresh, r.origin, m->probe);
    m->probe_downhill = vec_pick(fresh, r.direction, m->probe_downhill);
    m->probe_radius = pick(fresh, R(0.0), m->probe_radius);
    m->probes = pick(fresh, R(0.0), m->probes);
    m->factor = pick(fresh, PROOF_FACTOR, m->factor);
    m->retry_t = pick(fresh, R(0.0), m->retry_t);
    m->retry_radius = pick(fresh, R(0.0), m->retry_radius);
#endif
}

// One step of the active lanes; those that arrive, or leave their ray's part, are active no longer.
INLINE void march_step(march *m, int goal, __constant const struct March *settings, __constant const struct Orbit *orbit,
                       __constant const scalar *k) {
    const vec on_ray = vec_along(m->r.origin, m->t, m->r.direction);
#if HAS_DERIVATIVE
    const clearance here = orbit_scalar_distance(on_ray, m->active, orbit, k);
#else
    surface_point surface;
    const vec point = vec_pick(m->proving, m->probe, on_ray);
    const clearance here = orbit_dual_distance(point, m->active, orbit, k, &surface);
#endif
    // A distance grows no faster than one moves: where the estimate says otherwise it has met a point at which the
    // derivative vanishes, and means nothing.
    real radius = here.step * (real)(settings->step_scale);
    const real cone = (real)(settings->detail) * (m->r.footprint + m->r.spread * m->t);
    m->found.steps += pick(m->active, R(1.0), R(0.0));
    m->found.count += pick(m->active, here.end.count, R(0.0));

#if HAS_DERIVATIVE
    radius = fmin(radius, m->radius_before + m->step_before);
    const mask marching = m->active;
#else
    radius = pick(m->proving, radius, fmin(radius, m->radius_before + m->step_before));
    // Lanes that prove a hit: arrived, given up, or one step further down.
    mask failed = m->active & ~m->active;
    if (any_lane(m->proving)) {
        const vec offset = vec_sub(point, on_ray);
        real arrival = PROOF_ARRIVED * cone;
#if LOGARITHMIC
        const mask close = less(potential(here.end, surface, orbit) * (real)(settings->bounds_radius), PROOF_LOW * cone);
        arrival = pick(close, arrival, PROOF_LANDED * cone);
#endif
        const real along = vec_dot(offset, m->r.direction);
        const mask astray = less(PROOF_REACH * PROOF_REACH * cone * cone, vec_dot(offset, offset) - along * along);
        const mask arrived = m->proving & (here.end.inside | less(radius, arrival)) & ~astray;
        failed = m->proving & ~arrived & (astray | less_equal((real)(PROOF_STEPS), m->probes));
        m->found.hit |= arrived;
        m->found.t = pick(arrived, m->t, m->found.t);
        m->active &= ~arrived;
        m->retry_t = pick(failed, m->t + PROOF_APART * cone, m->retry_t);
        m->retry_radius = pick(failed, PROOF_CLOSER * m->radius_before, m->retry_radius);
        m->t = pick(failed, m->t + PROOF_ONWARD * cone, m->t);
        m->proving &= ~(arrived | failed);
    }
    const mask marching = m->active & ~m->proving & ~failed;
    vec downhill = m->r.direction;
    if (any_lane(m->proving | (marching & less(radius, cone)))) {
        downhill = vec_scale(vec_normalize(surface.gradient), R(-1.0));
        // Bolder while the slope keeps its direction and the distance does not shrink, timid once it has turned.
        const mask turned = less(vec_dot(downhill, m->probe_downhill), R(0.0));
        const mask slow = less(R(0.5) * m->probe_radius, radius);
        m->factor = pick(m->proving, m->factor * pick(turned, R(0.5), pick(slow, R(2.0), R(1.0))), PROOF_FACTOR);
    }
#endif

    // Over-relaxation (Keinert et al. 2014, sec. 3.1): if this sphere does not touch the one before, something may lie
    // between them, so go back to the end of the one before.
    const mask overshot = marching & less(R(1.0), m->relaxation) & less(radius + m->radius_before, m->step_before);
    mask inside = marching & ~overshot & here.end.inside;
#if POINTS > 1
    // A pixel's point begins near where the pixel's cone touched the set. What is inside there steps back, farther each time.
    const mask early = inside & less_equal((real)(REAL_LARGEST), m->radius_before) & less(m->r.known, RAY_NOTHING_KNOWN) &
                       less(m->found.steps, BACK_STEPS);
    inside &= ~early;
    m->low = pick(early, fmax(m->t - (real)(settings->known_reach) * cone * m->found.steps, R(0.0)), m->low);
#endif
    const mask outside = marching & ~overshot & ~here.end.inside;
    // (Not where it has only just begun.)
    const mask surprised = inside & ~less(m->high, (real)(REAL_LARGEST)) & less(R(1.5), m->found.steps);
    m->found.bad += pick(surprised, R(1.0), R(0.0));
    m->high = pick(inside, m->t, m->high);
    m->low = pick(outside, m->t, m->low);
#if MARCH_KEEPS_SURFACE
    m->found.end_surface.gradient = vec_pick(outside, surface.gradient, m->found.end_surface.gradient);
    m->found.end_surface.square = pick(outside, surface.square, m->found.end_surface.square);
    m->found.end_surface.square_before = pick(outside, surface.square_before, m->found.end_surface.square_before);
    m->found.end_count = pick(outside, here.end.count, m->found.end_count);
#endif

    // The pixel's cone touches the solid, or the crossing is narrowed down.
    const mask bracketed = marching & less(m->high, (real)(REAL_LARGEST));
#if HAS_DERIVATIVE
    const mask touched = outside & less(radius, cone);
#else
    const mask touched = outside & less(radius, cone) & (less_equal(m->retry_t, m->t) | less(radius, m->retry_radius));
#endif
    const mask narrow = goal == GOAL_SURFACE ? bracketed & less_equal(m->high - m->low, R(0.0625) * cone) : inside;
#if HAS_DERIVATIVE
    const mask done = touched | narrow;
#else
    // A bracketed lane has seen the inside already, and what a neighbouring point of the pixel has proved need not be
    // proved again.
#if POINTS > 1
    const mask proved = less(fabs(m->t - m->r.known), (real)(settings->known_reach) * cone);
    const mask done = narrow | (touched & (bracketed | proved));
#else
    const mask done = narrow | (touched & bracketed);
#endif
    m->proving |= touched & ~done;
    real down = m->factor * fmax(radius, PROOF_LANDED * cone);
#if POINTS > 1
    // A pixel's march must miss nothing within its cone: a step that is too bold would overshoot and count as astray.
    if (goal == GOAL_TOUCH) down = fmin(down, R(0.99) * PROOF_REACH * cone);
#endif
    m->probe = vec_pick(m->proving, vec_along(point, down, downhill), m->probe);
    m->probe_downhill = downhill;
    m->probe_radius = radius;
    m->probes = pick(m->proving, pick(touched, R(0.0), m->probes + R(1.0)), m->probes);
#endif
    m->found.hit |= done;
    m->found.t = pick(done, m->low, m->found.t);
    m->active &= ~done;

#if HAS_DERIVATIVE
    const real step = radius * m->relaxation;
#else
    const real step = fmax(radius * m->relaxation, PROOF_CREEP * cone);
#endif
    const real onward = pick(overshot, m->low + m->radius_before, m->t + step);
#if !HAS_DERIVATIVE
    m->relaxation = pick(failed, R(1.0), m->relaxation);
    m->step_before = pick(failed, PROOF_ONWARD * cone, m->step_before);
    const mask moving = marching & ~m->proving;
#else
    const mask moving = marching;
#endif
    m->relaxation = pick(overshot, R(1.0), m->relaxation);
    m->step_before = pick(overshot, m->radius_before, pick(moving, step, m->step_before));
#if POINTS > 1
    m->radius_before = pick(marching & ~overshot & ~early, radius, m->radius_before);
    m->t = pick(bracketed, R(0.5) * (m->low + m->high), pick(early, m->low, pick(moving, onward, m->t)));
#else
    m->radius_before = pick(marching & ~overshot, radius, m->radius_before);
    m->t = pick(bracketed, R(0.5) * (m->low + m->high), pick(moving, onward, m->t));
#endif
    m->active &= less(m->t, m->r.far) & less(m->found.steps, (real)((scalar)settings->max_steps));
}
