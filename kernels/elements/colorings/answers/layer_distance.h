// How far the surface of `layer` applications is from a point of the scene's own: outwards where that is a larger solid (fewer
// applications) and inwards where it is a smaller one, never negative, at most `coloring_limit`; exact to the footprint that
// the point may lie before its own surface.

#define WAY_START R(0.015625)    // the first of them on the way to a layer, in full steps

INLINE real layer_distance_answer(vec point, vec normal, vec view_direction, real cone, mask active, material_record material,
                                  orbit_record orbit, constants k) {
    vec outward = normal;
    if (material->along == ALONG_VIEW) outward = vec_scale(view_direction, R(-1.0));
    if (material->along == ALONG_REFLECTION) outward = vec_along(view_direction, R(-2.0) * vec_dot(view_direction, normal), normal);
    const real step = (real)(material->coloring_step), limit = (real)(material->coloring_limit);
    const int inward = material->layer > orbit->iterations;
    const gate met = way_until(inward, point, vec_scale(outward, inward ? R(-1.0) : R(1.0)), R(0.0), WAY_START * step, step,
                               limit, material->layer, active, material, orbit, k);
    return pick(met.found, fmin(R(0.5) * (met.before + met.beyond), limit), limit);
}
