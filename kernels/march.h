// Sphere tracing (Hart 1996) of a packet: steps of the distance to the solid until a ray's pixel cone touches it.

typedef struct {
    mask hit;
    real t;       // distance along the ray; of a hit, a point still outside the solid
    real steps;   // distance evaluations
    real count;   // formula applications of all of them
    real bad;     // steps that the distance called safe and that ended inside
} crossing;

// Marches the active lanes. `refine` (the same for all lanes) narrows a step that ended inside down to the surface;
// without it such a lane is simply a hit, which is all that a shadow needs.
INLINE crossing march(ray r, mask active, int refine, __constant const struct March *settings,
                      __constant const struct Orbit *orbit, __constant const scalar *k) {
    crossing found = {active & ~active, r.near, R(0.0), R(0.0), R(0.0)};
    real t = r.near;
    real low = t;                            // the last point known to be outside
    real high = (real)(REAL_LARGEST);        // a point known to be inside
    real relaxation = (real)(settings->relaxation);
    real radius_before = R(0.0), step_before = R(0.0);
    for (int i = 0; i < settings->max_steps; ++i) {
        if (!any_lane(active)) break;
        const sphere here = orbit_distance(vec_along(r.origin, t, r.direction), active, orbit, k);
        const real radius = here.step * (real)(settings->step_scale);
        const real cone = (real)(settings->detail) * (r.footprint + r.spread * t);
        found.steps += pick(active, R(1.0), R(0.0));
        found.count += pick(active, here.count, R(0.0));

        // Over-relaxation (Keinert et al. 2014, sec. 3.1): if this sphere does not touch the one before, something may lie
        // between them, so go back to the end of the one before.
        const mask overshot = active & less(R(1.0), relaxation) & less(radius + radius_before, step_before);
        const mask inside = active & ~overshot & here.inside;
        const mask outside = active & ~overshot & ~here.inside;
        if (i > 0) found.bad += pick(inside & ~less(high, (real)(REAL_LARGEST)), R(1.0), R(0.0));
        high = pick(inside, t, high);
        low = pick(outside, t, low);

        // The pixel's cone touches the solid, or the crossing is narrowed down.
        const mask bracketed = active & less(high, (real)(REAL_LARGEST));
        const mask touched = outside & less(radius, cone);
        const mask narrow = refine ? bracketed & less(high - low, R(0.0625) * cone) : inside;
        found.hit |= touched | narrow;
        found.t = pick(touched | narrow, low, found.t);
        active &= ~(touched | narrow);

        const real step = radius * relaxation;
        const real onward = pick(overshot, low + radius_before, t + step);
        relaxation = pick(overshot, R(1.0), relaxation);
        step_before = pick(overshot, radius_before, step);
        radius_before = pick(overshot, radius_before, radius);
        t = pick(bracketed, R(0.5) * (low + high), onward);
        active &= less(t, r.far);
    }
    return found;
}
