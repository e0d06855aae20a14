// Where media scatter light to.

// The part of light that is scattered into a direction, per steradian (Henyey and Greenstein 1941); `cosine`: between the ways before
// and after.
INLINE real phase_of(real cosine, real g) {
    const real base = fmax((R(1.0) + g * g) - (R(2.0) * g) * cosine, R(1e-6));
    return ((R(1.0) - g * g) * R(0.07957747154594767)) / (base * sqrt(base));
}

// The cosine of a turn that is chosen with the density of `phase_of`; 0 < u < 1.
INLINE real phase_cosine(real u, real g) {
    const mask even = less(fabs(g), R(0.001));
    const real turn = pick(even, R(1.0), g);
    const real part = (R(1.0) - turn * turn) / ((R(1.0) - turn) + (R(2.0) * turn) * u);
    const real along = clamp(((R(1.0) + turn * turn) - part * part) * (R(0.5) / turn), R(-1.0), R(1.0));
    return pick(even, R(1.0) - R(2.0) * u, along);
}

// A direction about the one before, chosen so.
INLINE vec phase_direction(vec before, real u, real v, real g) {
    const real along = phase_cosine(u, g), across = sqrt(fmax((R(1.0) - along) * (R(1.0) + along), R(0.0)));
    const real angle = R(6.283185307179586) * v;
    return in_frame(before, across * cos(angle), across * sin(angle), along);
}
