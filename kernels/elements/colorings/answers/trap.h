// How near the orbit comes to the trap.
INLINE real trap_answer(vec point, vec normal, vec view_direction, real cone, mask active, material_record material,
                        orbit_record orbit, constants k) {
    const trap near = {material->trap_shape, vec_splat(material->trap_center), vec_splat(material->trap_direction), (real)(material->trap_radius)};
    return orbit_near(near, point, active, orbit, k);
}
