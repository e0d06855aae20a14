// The quantity that chooses a surface point's place in the palette, by a material's `coloring`: its smooth escape count, how uneven the
// surface is there, how thick the set is behind it, how far off the surface of another iteration count lies, or how near
// its orbit comes to a shape.

#define WAY_GROWTH R(0.5)        // steps that grow: this part of the way so far
#define WAY_START R(0.015625)    // the first of them on the way to a layer, in full steps
#define WAY_TOLERANCE R(1e-4)    // part of a full step to which a crossing is narrowed down
// In footprints: how far behind a point of the surface the set may begin, and the first place to test. A distance of one
// footprint, which is a hit, is a lower bound; rough fractals have their solid at three (median) to ten.
#define ENTRANCE_REACH R(16.0)
#define ENTRANCE_START R(0.0625)

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

// How long the way from a point of the surface through the set is, from where it enters the set to where it first leaves it:
// 0 where the set does not begin within ENTRANCE_REACH or a step, at most `coloring_limit`. `direction` has length 1.
INLINE real set_thickness(vec point, vec direction, real cone, mask active, material_record material,
                          orbit_record orbit, constants k) {
    const real step = (real)(material->coloring_step), limit = (real)(material->coloring_limit);
    real begin = R(0.0), shortest = fmax(ENTRANCE_START * cone, WAY_TOLERANCE * step);
    real longest = fmax(ENTRANCE_REACH * cone, step), farthest = longest;
    real entrance = R(0.0), thickness = R(0.0);
    // One loop for both ends, so that the orbit is compiled once.
    for (int end = 0; end < 2; ++end) {
        const gate met = way_until(end == 0, point, direction, begin, shortest, longest, farthest, orbit->iterations, active,
                                   material, orbit, k);
        const real middle = R(0.5) * (met.before + met.beyond);
        if (end == 0) {
            active = met.found;
            entrance = middle;
            begin = pick(active, met.beyond, R(0.0));
            // Full steps from the start: growing steps would find every pore behind the surface.
            shortest = step;
            longest = step;
            farthest = begin + limit;
        } else {
            thickness = pick(met.found, fmin(middle - entrance, limit), limit);
        }
    }
    return pick(active, thickness, R(0.0));
}

// How far the surface of `layer` applications is from a point of the scene's own: outwards where that is a larger solid (fewer
// applications) and inwards where it is a smaller one, never negative, at most `coloring_limit`; exact to the footprint that
// the point may lie before its own surface. `outward` has length 1.
INLINE real layer_distance(vec point, vec outward, mask active, material_record material, orbit_record orbit, constants k) {
    const real step = (real)(material->coloring_step), limit = (real)(material->coloring_limit);
    const int inward = material->layer > orbit->iterations;
    const gate met = way_until(inward, point, vec_scale(outward, inward ? R(-1.0) : R(1.0)), R(0.0), WAY_START * step, step,
                               limit, material->layer, active, material, orbit, k);
    return pick(met.found, fmin(R(0.5) * (met.before + met.beyond), limit), limit);
}

#include "formulas/trap_near.h"

// The same, for the trap that chooses colours.
INLINE real orbit_trap(vec point, mask active, material_record material, orbit_record orbit, constants k) {
    const trap near = {material->trap_shape, vec_splat(material->trap_center), vec_splat(material->trap_direction), (real)(material->trap_radius)};
    return orbit_near(near, point, active, orbit, k);
}

// What chooses the colour of a point of the surface, in scene units (a trap's: those of z; `smooth`: applications; `residual`:
// footprints). `view_direction` leads from the viewer to the point, length 1; `cone` is the footprint there.
INLINE real coloring_quantity(vec point, vec normal, vec view_direction, real cone, real smooth, real residual, mask active,
                              material_record material, orbit_record orbit, constants k) {
    switch (material->coloring) {
    case COLORING_RESIDUAL: return residual;
    case COLORING_THICKNESS: {
        const vec way = material->along == ALONG_VIEW ? view_direction : vec_scale(normal, R(-1.0));
        return set_thickness(point, way, cone, active, material, orbit, k);
    }
    case COLORING_LAYER_DISTANCE: {
        vec outward = normal;
        if (material->along == ALONG_VIEW) outward = vec_scale(view_direction, R(-1.0));
        if (material->along == ALONG_REFLECTION) outward = vec_along(view_direction, R(-2.0) * vec_dot(view_direction, normal), normal);
        return layer_distance(point, outward, active, material, orbit, k);
    }
    case COLORING_TRAP: return orbit_trap(point, active, material, orbit, k);
    default: return smooth;
    }
}
