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

// Marches the active lanes towards one goal, the same for all lanes:
//   GOAL_SURFACE  the surface: hits are proved, and a step that ended inside is narrowed down to it
//   GOAL_SHADOW   whether anything is in the way: a step that ended inside is a hit
//   GOAL_TOUCH    how far a whole pixel's cone is free: the first proved touch, at a point still outside
INLINE crossing march(ray r, mask active, int goal, __constant const struct March *settings,
                      __constant const struct Orbit *orbit, __constant const scalar *k) {
    crossing found = nothing_met(r.near);
    real t = r.near;
    real low = t;                            // the last point known to be outside
    real high = (real)(REAL_LARGEST);        // a point known to be inside
    real relaxation = (real)(settings->relaxation);
    real radius_before = (real)(REAL_LARGEST), step_before = R(0.0);
#if !HAS_DERIVATIVE
    mask proving = active & ~active;
    vec probe = r.origin;
    vec probe_downhill = r.direction;
    real probe_radius = R(0.0);
    real probes = R(0.0), factor = PROOF_FACTOR;
    real retry_t = R(0.0), retry_radius = R(0.0);   // the next proof is due from this t on, or below this distance
#endif
    for (int i = 0; i < settings->max_steps; ++i) {
        if (!any_lane(active)) break;
        const vec on_ray = vec_along(r.origin, t, r.direction);
#if HAS_DERIVATIVE
        const sphere here = orbit_scalar_distance(on_ray, active, orbit, k);
#else
        surface_point surface;
        const vec point = vec_pick(proving, probe, on_ray);
        const sphere here = orbit_dual_distance(point, active, orbit, k, &surface);
#endif
        // A distance grows no faster than one moves: where the estimate says otherwise it has met a point at which the
        // derivative vanishes, and means nothing.
        real radius = here.step * (real)(settings->step_scale);
        const real cone = (real)(settings->detail) * (r.footprint + r.spread * t);
        found.steps += pick(active, R(1.0), R(0.0));
        found.count += pick(active, here.count, R(0.0));

#if HAS_DERIVATIVE
        radius = fmin(radius, radius_before + step_before);
        const mask marching = active;
#else
        radius = pick(proving, radius, fmin(radius, radius_before + step_before));
        // Lanes that prove a hit: arrived, given up, or one step further down.
        mask failed = active & ~active;
        if (any_lane(proving)) {
            const vec offset = vec_sub(point, on_ray);
            real arrival = PROOF_ARRIVED * cone;
#if LOGARITHMIC
            const mask low = less(potential(here, surface, orbit) * (real)(settings->bounds_radius), PROOF_LOW * cone);
            arrival = pick(low, arrival, PROOF_LANDED * cone);
#endif
            const real along = vec_dot(offset, r.direction);
            const mask astray = less(PROOF_REACH * PROOF_REACH * cone * cone, vec_dot(offset, offset) - along * along);
            const mask arrived = proving & (here.inside | less(radius, arrival)) & ~astray;
            failed = proving & ~arrived & (astray | less_equal((real)(PROOF_STEPS), probes));
            found.hit |= arrived;
            found.t = pick(arrived, t, found.t);
            active &= ~arrived;
            retry_t = pick(failed, t + PROOF_APART * cone, retry_t);
            retry_radius = pick(failed, PROOF_CLOSER * radius_before, retry_radius);
            t = pick(failed, t + PROOF_ONWARD * cone, t);
            proving &= ~(arrived | failed);
        }
        const mask marching = active & ~proving & ~failed;
        vec downhill = r.direction;
        if (any_lane(proving | (marching & less(radius, cone)))) {
            downhill = vec_scale(vec_normalize(surface.gradient), R(-1.0));
            // Bolder while the slope keeps its direction and the distance does not shrink, timid once it has turned.
            const mask turned = less(vec_dot(downhill, probe_downhill), R(0.0));
            const mask slow = less(R(0.5) * probe_radius, radius);
            factor = pick(proving, factor * pick(turned, R(0.5), pick(slow, R(2.0), R(1.0))), PROOF_FACTOR);
        }
#endif

        // Over-relaxation (Keinert et al. 2014, sec. 3.1): if this sphere does not touch the one before, something may lie
        // between them, so go back to the end of the one before.
        const mask overshot = marching & less(R(1.0), relaxation) & less(radius + radius_before, step_before);
        const mask inside = marching & ~overshot & here.inside;
        const mask outside = marching & ~overshot & ~here.inside;
        if (i > 0) found.bad += pick(inside & ~less(high, (real)(REAL_LARGEST)), R(1.0), R(0.0));
        high = pick(inside, t, high);
        low = pick(outside, t, low);
#if MARCH_KEEPS_SURFACE
        found.surface.gradient = vec_pick(outside, surface.gradient, found.surface.gradient);
        found.surface.square = pick(outside, surface.square, found.surface.square);
        found.surface.square_before = pick(outside, surface.square_before, found.surface.square_before);
        found.end_count = pick(outside, here.count, found.end_count);
#endif

        // The pixel's cone touches the solid, or the crossing is narrowed down.
        const mask bracketed = marching & less(high, (real)(REAL_LARGEST));
#if HAS_DERIVATIVE
        const mask touched = outside & less(radius, cone);
#else
        const mask touched = outside & less(radius, cone) & (less_equal(retry_t, t) | less(radius, retry_radius));
#endif
        const mask narrow = goal == GOAL_SURFACE ? bracketed & less_equal(high - low, R(0.0625) * cone) : inside;
#if HAS_DERIVATIVE
        const mask done = touched | narrow;
#else
        // A bracketed lane has seen the inside already, and what a neighbouring point of the pixel has proved need not be
        // proved again.
#if POINTS > 1
        const mask proved = less(fabs(t - r.known), (real)(settings->known_reach) * cone);
        const mask done = narrow | (touched & (bracketed | proved));
#else
        const mask done = narrow | (touched & bracketed);
#endif
        proving |= touched & ~done;
        real down = factor * fmax(radius, PROOF_LANDED * cone);
#if POINTS > 1
        // A pixel's march must miss nothing within its cone: a step that is too bold would overshoot and count as astray.
        if (goal == GOAL_TOUCH) down = fmin(down, R(0.99) * PROOF_REACH * cone);
#endif
        probe = vec_pick(proving, vec_along(point, down, downhill), probe);
        probe_downhill = downhill;
        probe_radius = radius;
        probes = pick(proving, pick(touched, R(0.0), probes + R(1.0)), probes);
#endif
        found.hit |= done;
        found.t = pick(done, low, found.t);
        active &= ~done;

#if HAS_DERIVATIVE
        const real step = radius * relaxation;
#else
        const real step = fmax(radius * relaxation, PROOF_CREEP * cone);
#endif
        const real onward = pick(overshot, low + radius_before, t + step);
#if !HAS_DERIVATIVE
        relaxation = pick(failed, R(1.0), relaxation);
        step_before = pick(failed, PROOF_ONWARD * cone, step_before);
        const mask moving = marching & ~proving;
#else
        const mask moving = marching;
#endif
        relaxation = pick(overshot, R(1.0), relaxation);
        step_before = pick(overshot, radius_before, pick(moving, step, step_before));
        radius_before = pick(marching & ~overshot, radius, radius_before);
        t = pick(bracketed, R(0.5) * (low + high), pick(moving, onward, t));
        active &= less(t, r.far);
    }
    return found;
}
