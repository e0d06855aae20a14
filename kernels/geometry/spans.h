// Parts of a ray's line, in units of a shape's own.

// A direction's component as a divisor.
INLINE real divisor(real a) { return pick(less(fabs(a), R(1e-30)), R(1e-30), a); }

// `exit` is below `entry` where there is none.
typedef struct {
    real entry, exit;
} span;

INLINE span span_of_both(span a, span b) { return (span){fmax(a.entry, b.entry), fmin(a.exit, b.exit)}; }

// Between two places where a ray's component is -1 and 1.
INLINE span span_of_slab(real from, real way) {
    const real share = R(1.0) / divisor(way), a = (R(-1.0) - from) * share, b = (R(1.0) - from) * share;
    return (span){fmin(a, b), fmax(a, b)};
}

// The first place of a span's rim on a ray, or the largest number: where it enters a solid, or from inside where it leaves it.
INLINE real span_first(span s) {
    const real first = pick(less(R(0.0), s.entry), s.entry, s.exit);
    return pick(less(s.entry, s.exit) & less(R(0.0), first), first, (real)(REAL_LARGEST));
}

INLINE real above_length(real a, real b, real c) {
    const real x = fmax(a, R(0.0)), y = fmax(b, R(0.0)), z = fmax(c, R(0.0));
    return sqrt(x * x + y * y + z * z);
}

// Within the ball of radius 1.
INLINE span span_of_ball(vec from, vec way) {
    // By the way's nearest place to the middle, since b^2 - c would cancel for a far-off origin.
    const real share = R(1.0) / fmax(sqrt(vec_dot(way, way)), R(1e-30));
    const vec along = vec_scale(way, share);
    const real middle = -vec_dot(from, along);
    const vec nearest = vec_along(from, middle, along);
    const real square = R(1.0) - vec_dot(nearest, nearest), half_chord = sqrt(fmax(square, R(0.0)));
    const mask meets = less(R(0.0), square);
    return (span){pick(meets, (middle - half_chord) * share, R(1.0)), pick(meets, (middle + half_chord) * share, R(-1.0))};
}
