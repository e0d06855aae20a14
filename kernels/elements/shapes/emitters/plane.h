// Of a plane without an end, which shines on both sides, a direction to it is chosen by the cosine to its normal.
INLINE emitter_place plane_place(vec form, vec sides, vec point, real choice, real u, real v, const vec *met) {
    vec way;
    if (met) {
        way = vec_sub(*met, point);
    } else {
        real x, y;
        unit_disk(u, v, &x, &y);
        const real down = sqrt(fmax(R(1.0) - x * x - y * y, R(1e-8))), high = fabs(point.z) / down;
        way = vec_of(x * high, y * high, -point.z);
    }
    const real far = sqrt(vec_dot(way, way));
    return (emitter_place){way, fabs(way.z) / (LIGHT_PI * fmax(far, (real)(REAL_SMALLEST)))};
}

// It fills half of all directions.
INLINE real plane_weight(vec form, vec sides, vec point, real bright) {
    return pick(less(R(0.0), fabs(point.z)), LIGHT_PI * bright, R(0.0));
}
