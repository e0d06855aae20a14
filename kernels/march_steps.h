// The other search for the surface (Englund 2010, sec. 3.2.3): fixed steps and the inside test alone, then a binary search
// between the last point outside and the first one inside. Needs no distance; misses what is thinner than a step.
//
//   GOAL_SURFACE  steps until inside, then the binary search down to the number type's precision
//   GOAL_SHADOW   steps until inside
//   GOAL_TOUCH    the same: where the pixel's points begin their own search
//   GOAL_POINT    from r.known: steps back while inside, forwards while outside, then the binary search. The thesis gives a
//                 point one step either way; at a rim or on a steep slope its surface is farther off, or another one
//
// A shadow ray's steps grow from the size of a pixel to the full step: what is in the way often begins close by, and a full
// step at once would leap over it and let dots of light into every crease.
#define SHADOW_FIRST R(2.0)   // step, in the ray's footprints
#define SHADOW_GROWTH R(1.5)

INLINE crossing march(ray r, mask active, int goal, __constant const struct March *settings,
                      __constant const struct Orbit *orbit, __constant const scalar *k) {
    crossing found = nothing_met(r.near);
    const real step = (real)(settings->step);
    const int narrows = goal == GOAL_SURFACE || goal == GOAL_POINT;
    real pace = goal == GOAL_SHADOW ? fmin(SHADOW_FIRST * r.footprint, step) : step;
    real t = goal == GOAL_POINT ? clamp(r.known, r.near, r.far) : r.near;
    real low = t, high = t;  // the last points seen outside and inside
    mask seen_outside = active & ~active, seen_inside = active & ~active;
    while (any_lane(active)) {
        const sphere here = orbit_solid(vec_along(r.origin, t, r.direction), active, orbit->iterations, orbit, k);
        found.steps += pick(active, R(1.0), R(0.0));
        found.count += pick(active, here.count, R(0.0));
        const mask inside = active & here.inside;
        const mask outside = active & ~here.inside;
        seen_inside |= inside;
        seen_outside |= outside;
        low = pick(outside, t, low);
        high = pick(inside, t, high);

        // What is inside from the beginning of the ray on is hit there.
        const mask bracketed = seen_inside & seen_outside;
        const mask finest = bracketed & less_equal(high - low, R(2.0) * (real)(REAL_EPSILON) * fmax(fabs(t), step));
        const mask cut = inside & ~seen_outside & less_equal(t, r.near);
        const mask done = active & (narrows ? finest | cut : inside);
        found.hit |= done;
        found.t = pick(done, pick(bracketed, low, t), found.t);
        active &= ~done;

        const real onward = pick(inside, fmax(t - pace, r.near), t + pace);
        t = pick(bracketed, R(0.5) * (low + high), onward);
        pace = fmin(SHADOW_GROWTH * pace, step);
        active &= less_equal(t, r.far);
    }
    return found;
}
