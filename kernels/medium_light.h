// Light of a place in a medium.

// One of all lights is asked there, and weighed as if the phase function could have chosen its direction; the result is what it brings if
// nothing is in its way. Numbers as for `light_asked`.
INLINE color medium_asks(vec point, vec direction, real anisotropy, const real *numbers, real total, world w, asked *a) {
    *a = light_asked(point, point, vec_of(R(0.0), R(0.0), R(0.0)), R(0.0), numbers, total, w);
    const real phase = phase_of(vec_dot(direction, a->ray.toward), anisotropy);
    return color_scale(a->ray.light, phase * asked_weight(a, phase));
}
