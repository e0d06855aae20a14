// Where a way through the set crosses its surface.

#define WAY_GROWTH R(0.5)        // steps that grow: this part of the way so far
#define WAY_TOLERANCE R(1e-4)    // part of a full step to which a crossing is narrowed down

// A crossing of the solid's surface on a way, as distances from where it starts.
typedef struct {
    mask found;
    real before;  // the last place of the one side ...
    real beyond;  // ... and the first of the other
} gate;

// Follows a way until it is inside (`inward` 1) or outside (0) the solid of `limit` applications: from the distance `begin`
// in steps that grow from `shortest` to `longest`, then by bisection. What is thinner than a step may be missed.
INLINE gate way_until(int inward, vec from, vec direction, real begin, real shortest, real longest, real farthest, int limit,
                      mask active, material_record material, orbit_record orbit, constants k) {
    gate met = {active & ~active, begin, (real)(REAL_LARGEST)};
    real t = begin;
    // Not finer than the resolution of the number type.
    const real size = fmax(fmax(fabs(from.x), fabs(from.y)), fabs(from.z));
    const real coarse = (real)(material->coloring_step) * WAY_TOLERANCE;
    for (int i = 0; i < material->coloring_tests; ++i) {
        if (!any_lane(active)) break;
        const mask inside = orbit_inside(vec_along(from, t, direction), active, limit, orbit, k);
        const mask there = active & (inward ? inside : ~inside);
        met.beyond = pick(there, t, met.beyond);
        met.before = pick(active & ~there, t, met.before);
        met.found |= there;
        const real tolerance = fmax(coarse, R(2.0) * (real)(REAL_EPSILON) * (size + fabs(t)));
        active &= (met.found & less(tolerance, met.beyond - met.before)) | (~met.found & less(met.before, farthest));
        const real step = clamp(WAY_GROWTH * (met.before - begin), shortest, longest);
        t = pick(met.found, R(0.5) * (met.before + met.beyond), fmin(met.before + step, farthest));
    }
    return met;
}
