// A number that the formula carries beside z, as it is when the orbit ends.
INLINE real carried_answer(vec point, vec normal, vec view_direction, real cone, mask active, material_record material,
                           orbit_record orbit, constants k) {
    if (!CARRIES_NUMBERS) return R(0.0);
    const vec none = vec_of(R(0.0), R(0.0), R(0.0));
    return orbit_told((trap){0, none, none, R(0.0)}, material->carried, point, active, orbit, k);
}
