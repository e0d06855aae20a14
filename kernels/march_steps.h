// The other search for the surface (Englund 2010, sec. 3.2.3): fixed steps and the inside test alone, then a binary search,
// forwards from outside and backwards from inside, each time half as far. Needs no distance; misses what is thinner than
// a step.
//
//   GOAL_SURFACE  steps until inside, then the binary search down to the number type's precision
//   GOAL_SHADOW   steps until inside
//   GOAL_TOUCH    the same: where the pixel's points begin their own search
//   GOAL_POINT    the binary search alone, from r.near and a whole step either way
INLINE crossing march(ray r, mask active, int goal, __constant const struct March *settings,
                      __constant const struct Orbit *orbit, __constant const scalar *k) {
    crossing found = nothing_met(r.near);
    const real step = (real)(settings->step);
    const mask searches_only = goal == GOAL_POINT ? active : active & ~active;
    mask searching = searches_only;
    mask seen_outside = active & ~active, seen_inside = active & ~active;
    real half_way = step;
    // A shadow ray's first step leaves the roughness that it starts from.
    real t = goal == GOAL_SHADOW ? r.near + step : r.near;
    real low = r.near;  // the last point seen outside
    active &= less(t, r.far) | searches_only;
    while (any_lane(active)) {
        const sphere here = orbit_solid(vec_along(r.origin, t, r.direction), active, orbit->iterations, orbit, k);
        found.steps += pick(active, R(1.0), R(0.0));
        found.count += pick(active, here.count, R(0.0));
        const mask inside = active & here.inside;
        const mask outside = active & ~here.inside;
        seen_inside |= inside;
        seen_outside |= outside;
        low = pick(outside, t, low);

        // Without a search the first point inside ends it; what begins inside is hit where it begins.
        const mask at_once = inside & (goal == GOAL_SURFACE ? ~seen_outside : goal == GOAL_POINT ? active & ~active : inside);
        const mask finest = searching & less_equal(half_way, R(2.0) * (real)(REAL_EPSILON) * fmax(fabs(t), step));
        found.hit |= at_once | (finest & seen_inside & seen_outside);
        found.t = pick(at_once, t, pick(finest, low, found.t));
        active &= ~(at_once | finest);

        searching |= inside & active;
        half_way = pick(searching, R(0.5) * half_way, half_way);
        t += pick(searching, pick(inside, -half_way, half_way), step);
        active &= searching | less_equal(t, r.far);
    }
    return found;
}
