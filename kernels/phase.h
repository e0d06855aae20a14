// Where media scatter light to.

// The part of light that is scattered into a direction, per steradian (Henyey and Greenstein 1941); `cosine`: between the ways before
// and after.
INLINE real phase_of(real cosine, scalar g) {
    const real base = fmax((real)(S(1.0) + g * g) - (real)(S(2.0) * g) * cosine, R(1e-6));
    return (real)((S(1.0) - g * g) * S(0.07957747154594767)) / (base * sqrt(base));
}

// The cosine of a turn that is chosen with the density of `phase_of`; 0 < u < 1.
INLINE real phase_cosine(real u, scalar g) {
    if (fabs(g) < S(0.001)) return R(1.0) - R(2.0) * u;
    const real part = (real)(S(1.0) - g * g) / ((real)(S(1.0) - g) + (real)(S(2.0) * g) * u);
    return clamp(((real)(S(1.0) + g * g) - part * part) * (real)(S(0.5) / g), R(-1.0), R(1.0));
}

// A direction about the one before, chosen so.
INLINE vec phase_direction(vec before, real u, real v, scalar g) {
    const real along = phase_cosine(u, g), across = sqrt(fmax((R(1.0) - along) * (R(1.0) + along), R(0.0)));
    const real angle = R(6.283185307179586) * v;
    return in_frame(before, across * cos(angle), across * sin(angle), along);
}
