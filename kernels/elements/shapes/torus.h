// The torus around z that fills the box between -1 and 1; `form` has the radii of its ring and of its tube, which are 1 together, in units
// of x. With unequal sides its distances are too small, but not their directions.

// An own place with z in units of x, too.
INLINE vec torus_even(vec form, vec own) { return vec_of(own.x, own.y, own.z * form.y); }

// From the nearest place of the ring's circle to an even place; the tube is around that circle.
INLINE vec torus_offset(vec form, vec even) {
    const real arm = sqrt(even.x * even.x + even.y * even.y), off = arm - form.x;
    const mask on_axis = less(arm, R(1e-30));
    const real share = R(1.0) / fmax(arm, R(1e-30));
    return vec_of(off * pick(on_axis, R(1.0), even.x * share), off * even.y * share, even.z);
}

// How far the tube is from an even place; below 0 inside.
INLINE real torus_height(vec form, vec even) {
    const vec off = torus_offset(form, even);
    return sqrt(vec_dot(off, off)) - form.y;
}

// Where a ray passes the surface between two places of it, the one outside and the other inside: by Newton's steps, or by halves where
// these would leave what is left.
INLINE real torus_crossing(vec form, vec from, vec way, real out, real in) {
    const real slack = R(16.0) * (real)(REAL_EPSILON);   // places are known so well only
    real t = R(0.5) * (out + in);
    for (int i = 0; i < 12; ++i) {
        const vec off = torus_offset(form, vec_along(from, t, way));
        const real far = sqrt(vec_dot(off, off)), height = far - form.y;
        const mask inside = less(height, R(0.0));
        in = pick(inside, t, in);
        out = pick(inside, out, t);
        const real next = t - height * far / divisor(vec_dot(off, way));
        const real low = fmin(out, in) - slack, high = fmax(out, in) + slack;
        const mask between = less_equal(low, next) & less_equal(next, high);
        t = pick(between, next, R(0.5) * (out + in));
    }
    return t;
}

enum { torus_turn = SEARCH };

// Along a ray, from its nearest place to the middle on, the equation of the torus is t^4 + 2 p t^2 + 4 q t + r = 0. Its minima, one or
// two, are roots of t^3 + p t + q; where the place between two of them is outside, so are two parts of the ray inside.
INLINE span torus_span(vec form, int number, vec from, vec way) {
    const vec begin = torus_even(form, from), scaled = torus_even(form, way);
    const real share = R(1.0) / fmax(sqrt(vec_dot(scaled, scaled)), R(1e-30));
    const vec along = vec_scale(scaled, share);
    const real middle = -vec_dot(begin, along);
    const vec nearest = vec_along(begin, middle, along);
    const real square = vec_dot(nearest, nearest), half_chord = sqrt(fmax(R(1.0) - square, R(0.0)));
    if (!any_lane(less(square, R(1.0)))) return (span){R(1.0), R(-1.0)};
    const real ring = form.x * form.x, across = along.x * along.x + along.y * along.y;
    const real p = square + ring - form.y * form.y - R(2.0) * ring * across, q = R(2.0) * ring * nearest.z * along.z;
    // The root farthest from 0, from beyond it; the others are those of a square equation.
    real root = copysign(R(1.0), -q);
    for (int i = 0; i < 10; ++i) root -= ((root * root + p) * root + q) / fmax(R(3.0) * root * root + p, R(1e-6));
    const real rest = R(-3.0) * root * root - R(4.0) * p, arm = copysign(R(0.5) * sqrt(fmax(rest, R(0.0))), root);
    const mask two = less(R(0.0), rest), later = less(R(0.0), root);
    const real other = pick(two, R(-0.5) * root - arm, root), between = R(-0.5) * root + arm;
    const real first = pick(later, other, root), last = pick(later, root, other);
    const mask apart = two & less_equal(R(0.0), torus_height(form, vec_along(nearest, between, along)));
    const real enters = number == 0 ? first : last, leaves = number == 0 ? pick(apart, first, last) : last;
    const real before = number == 0 ? -half_chord : between, after = number == 0 ? pick(apart, between, half_chord) : half_chord;
    mask inside = less(square, R(1.0)) & less(torus_height(form, vec_along(nearest, enters, along)), R(0.0));
    if (number != 0) inside &= apart;
    if (!any_lane(inside)) return (span){R(1.0), R(-1.0)};
    const real entry = torus_crossing(form, nearest, along, before, enters), exit = torus_crossing(form, nearest, along, after, leaves);
    return (span){pick(inside, (middle + entry) * share, R(1.0)), pick(inside, (middle + exit) * share, R(-1.0))};
}

INLINE vec torus_normal(vec form, vec own) { return torus_even(form, torus_offset(form, torus_even(form, own))); }

// Where the tube is, the circle goes on with the way, and turns.
INLINE vec torus_bends(vec form, vec own, vec way) {
    const vec even = torus_even(form, own), along = torus_even(form, way);
    const real share = R(1.0) / fmax(sqrt(even.x * even.x + even.y * even.y), R(1e-30)), ring = form.x * share;
    const real out = ring * share * share * (even.x * along.x + even.y * along.y);
    return torus_even(form, vec_of((R(1.0) - ring) * along.x + out * even.x, (R(1.0) - ring) * along.y + out * even.y, along.z));
}

INLINE vec torus_on(vec form, vec own) {
    const vec even = torus_even(form, own), off = torus_offset(form, even);
    const vec on = vec_along(even, form.y / fmax(sqrt(vec_dot(off, off)), R(1e-30)) - R(1.0), off);
    return vec_of(on.x, on.y, on.z / form.y);
}

INLINE mask torus_holds(vec form, vec own) { return less(torus_height(form, torus_even(form, own)), R(0.0)); }

INLINE real torus_far(vec form, vec own, vec sides, vec *n) {
    *n = torus_normal(form, own);
    return torus_height(form, torus_even(form, own)) * fmin(fmin(sides.x, sides.y), sides.z / form.y);
}
