// The mean curvature, half the divergence of the normals, above 0 where the set bulges: by differences over `coloring_step`, on the
// surface of equal distance that lies so far above it, since below it there may be no gradient. A sphere's is then corrected exactly.
INLINE real curvature_answer(vec point, vec normal, vec view_direction, real cone, mask active, material_record material,
                             orbit_record orbit, constants k) {
    const real step = (real)(material->coloring_step);
    const vec above = vec_along(point, step, normal);
    vec side, up;
    make_frame(normal, &side, &up);
    real sum = R(0.0);
    for (int i = 0; i < TURNS(4); ++i) {
        const vec way = vec_scale(i < 2 ? side : up, i & 1 ? R(-0.5) : R(0.5));
        surface_point found;
        const clearance there = orbit_dual_distance(vec_along(above, step, way), active, OF_SURFACE, orbit, k, &found);
        const vec gradient = vec_normalize(found.gradient);
        // Where there is none, as it is in the middle.
        const mask flat = less(vec_dot(gradient, gradient), R(0.5)) | there.end.inside;
        sum += pick(flat, R(0.0), R(2.0) * vec_dot(vec_sub(gradient, normal), way) / step);
    }
    const real mean = R(0.5) * sum;
    return mean / fmax(R(1.0) - mean * step, R(0.1));
}
