// What a march has found, as the stages after it read it.
INLINE encounter encounter_of(crossing c) {
    const vec none = {R(0.0), R(0.0), R(0.0)};
    const encounter e = {number_of(c.hit), c.steps, c.count, c.t, c.bad, c.touch, c.last, none, R(0.0), R(0.0), R(0.0)};
    return e;
}

// The normal of the surface where a march has ended, and its escape count. Both are taken where the ray's cone came near the
// solid: most of these surfaces are rougher than a pixel, and there the distance has smoothed them over the pixel's footprint.
// Where the surface is smooth light is computed at the hit: there both normals differ little for the way between them.
#define SMOOTH R(0.009)  // radians a footprint: a smooth surface turns at most so fast ...
#define ROUGH R(0.013)   // ... and one that turns faster is rough
INLINE vec surface_normal(vec wide, vec fine, encounter *met, real cone) {
    const real way = fmax(met->last - met->touch, R(0.01) * cone);
    const vec turn = vec_scale(vec_sub(fine, wide), R(1.0) / way);
    const real share = clamp((ROUGH - sqrt(vec_dot(turn, turn)) * cone) / (ROUGH - SMOOTH), R(0.0), R(1.0));
    const vec at_hit = vec_along(fine, met->t - met->last, turn);
    met->touch += share * (met->t - met->touch);
    return vec_normalize(vec_along(wide, share, vec_sub(at_hit, wide)));
}

#if POLISH
#define POLISH_HEIGHT R(0.16667)
// A place that does not depend on how the march came there: where the distance is a sixth of the cone, by the secant method (the
// slope is that of a distance, -1, at first). Normals from the positions of points need it.
INLINE surface_point surface_polished(ray r, encounter *met, mask active, __constant const struct March *settings,
                                      __constant const struct Orbit *orbit, __constant const scalar *k, clearance *there) {
    surface_point surface;
    const real cone = (real)(settings->detail) * (r.footprint + r.spread * met->t);
    const real wanted = POLISH_HEIGHT * cone;
    real t = met->touch, before = t, height_before = R(0.0);
    for (int i = 0; i < TURNS(POLISH); ++i) {
        *there = orbit_dual_distance(vec_along(r.origin, t, r.direction), active, orbit, k, &surface);
        met->more_count += pick(active, there->end.count, R(0.0));
        met->more_steps += pick(active, R(1.0), R(0.0));
        if (i == POLISH - 1) break;
        const real height = there->step * (real)(settings->step_scale) - wanted;
        const real slope = (height - height_before) / (t - before);
        const mask usable = less(slope, R(0.0)) & less(R(-1e6), slope);
        const real move = i == 0 ? height : pick(usable, -height / slope, height);
        before = t;
        height_before = height;
        t += clamp(move, -cone, cone);
    }
    met->touch = pick(active, t, met->touch);
    met->t = pick(active, t, met->t);
    return surface;
}
#endif

// The surface where a march has ended: its normal and its escape count. `touch` becomes the place that is shaded.
INLINE void surface_at(ray r, encounter *met, mask active, __constant const struct March *settings,
                       __constant const struct Orbit *orbit, __constant const scalar *k) {
    met->touch = fmin(met->touch, met->last);
    const real cone = (real)(settings->detail) * (r.footprint + r.spread * met->t);
    clearance there;
    vec normal;
    met->more_steps = met->more_count = R(0.0);
#if POLISH
    const surface_point surface = surface_polished(r, met, active, settings, orbit, k, &there);
    normal = vec_normalize(surface.gradient);
#else
    surface_point surface, at_hit;
    for (int i = 0; i < TURNS(2); ++i) {
        surface = at_hit;
        const real t = i == 0 ? met->touch : met->last;
        const clearance here = orbit_dual_distance(vec_along(r.origin, t, r.direction), active, orbit, k, &at_hit);
        if (i == 0) there = here;
        met->more_count += pick(active, here.end.count, R(0.0));
    }
    normal = surface_normal(vec_normalize(surface.gradient), vec_normalize(at_hit.gradient), met, cone);
#endif
    // No gradient: inside the solid already at the eye, or an extremum. Face the viewer.
    const mask flat = less(vec_dot(normal, normal), R(0.5)) | there.end.inside;
    normal = vec_pick(flat, vec_scale(r.direction, R(-1.0)), normal);
    // What is seen does not face away, but for a pixel's width past a rim. A hit on the far side of a sheet thinner than a pixel
    // does: mirrored, it stands for the near side.
    const real away = vec_dot(normal, r.direction);
    met->normal = vec_pick(less(R(0.1), away), vec_along(normal, R(-2.0) * away, r.direction), normal);
    met->smooth = smooth_count(there.end, surface, orbit);
}
