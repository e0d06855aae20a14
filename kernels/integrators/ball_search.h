// Where chains cross a ball between two ends: all of them lie in the plane of both ends and its middle, so by what angle they set out is one
// number. Its range is gone through in steps, and each change of sign of what the ray misses the end by, also one that two turns of it hide, is
// a chain. So all are found.
#include "integrators/chains.h"

#define BALL_STEPS 32
#define BALL_DIPS 6        // steps to where two chains of a ball may part
#define BALL_TURNS 12      // and to a chain between two steps

// The plane of a ball's chains: `away` from the event to the middle, and `across`, where the end is on the positive side.
typedef struct {
    vec away, across;
    real distance, radius, index;
    real end_away, end_across;
    mask far;
} ball_plane;

INLINE ball_plane ball_plane_of(object_record o, real index, vec from, const chain_end *end) {
    ball_plane b;
    vec unused;
    const vec offset = vec_sub(vec_splat(o->middle), from);
    b.distance = sqrt(vec_dot(offset, offset));
    b.away = vec_scale(offset, R(1.0) / fmax(b.distance, (real)(REAL_SMALLEST)));
    const vec toward = vec_pick(end->far, end->at, vec_sub(end->at, from));
    b.end_away = vec_dot(toward, b.away);
    const vec beside = vec_along(toward, -b.end_away, b.away);
    b.end_across = sqrt(vec_dot(beside, beside));
    make_frame(b.away, &b.across, &unused);
    // (On the axis all planes are alike.)
    b.across = vec_pick(less(R(1e-6) * fabs(b.end_away), b.end_across), vec_normalize(beside), b.across);
    b.radius = (real)(o->sides[0]);
    b.index = index;
    b.far = end->far;
    return b;
}

// The direction of a ray, along `away` and `across`, and what it misses the end by; `u` from -1 to 1: where it enters the ball, closer where
// it does so at a grazing angle.
INLINE real ball_misses(const ball_plane *b, real u, real *away, real *across) {
    const real sine = u * (R(1.5) - R(0.5) * u * u), cosine = sqrt(fmax(R(1.0) - sine * sine, R(0.0)));
    const real inner_sine = sine / b->index, inner = sqrt(R(1.0) - inner_sine * inner_sine);
    *across = sine * b->radius / b->distance;
    *away = sqrt(fmax(R(1.0) - *across * *across, R(0.0)));
    // Each boundary turns it by the difference of these angles, towards the axis.
    const real c = cosine * inner + sine * inner_sine, s = sine * inner - cosine * inner_sine;
    const real within_away = *away * c + *across * s, within_across = *across * c - *away * s;
    const real out_away = within_away * c + within_across * s, out_across = within_across * c - within_away * s;
    const real first = b->distance * *away - b->radius * cosine, chord = R(2.0) * b->radius * inner;
    const real left_away = b->end_away - pick(b->far, R(0.0), first * *away + chord * within_away);
    const real left_across = b->end_across - pick(b->far, R(0.0), first * *across + chord * within_across);
    return out_away * left_across - out_across * left_away;
}

// Where the sign changes between two places (the Illinois method).
CALLED real ball_crossing(const ball_plane *b, real low, real low_misses, real high, real high_misses, mask here) {
    real away, across, middle = high, last = R(0.0);
    for (int turn = 0; turn < BALL_TURNS; ++turn) {
        const real over = low_misses - high_misses;
        middle = pick(here, (low_misses * high - high_misses * low) / pick(equal(over, R(0.0)), R(1.0), over), middle);
        const real misses = ball_misses(b, middle, &away, &across);
        const mask same = (less(misses, R(0.0)) & less(low_misses, R(0.0))) | (~less(misses, R(0.0)) & ~less(low_misses, R(0.0)));
        // An end that stays twice counts half, so that it does not stay for ever.
        high_misses = pick(same & less(last, R(0.0)), R(0.5) * high_misses, high_misses);
        low_misses = pick(~same & less(R(0.0), last), R(0.5) * low_misses, low_misses);
        low = pick(same, middle, low);
        low_misses = pick(same, misses, low_misses);
        high = pick(same, high, middle);
        high_misses = pick(same, high_misses, misses);
        last = pick(same, R(-1.0), R(1.0));
    }
    return middle;
}

// Between three places with one sign, of which the middle one is nearest to none: a place with another one, if there is one (by parabolas).
CALLED mask ball_parts(const ball_plane *b, real low, real a, real *middle, real *misses, real high, real c, mask here) {
    mask found = here & ~here;
    const mask negative = less(a, R(0.0));
    real away, across;
    for (int turn = 0; turn < BALL_DIPS; ++turn) {
        const real left = *middle - low, right = high - *middle, at = *misses;
        const real p = left * (at - c), q = right * (at - a), both = p + q;
        const real step = R(0.5) * (left * p - right * q) / pick(equal(both, R(0.0)), R(1.0), both);
        real next = clamp(*middle - step, low + R(0.05) * left, high - R(0.05) * right);
        next = pick(less(fabs(next - *middle), R(1e-3) * (high - low)), *middle + R(0.1) * pick(less(left, right), right, -left), next);
        const real m = ball_misses(b, next, &away, &across);
        const mask other = here & ~found & ((less(m, R(0.0)) & ~negative) | (~less(m, R(0.0)) & negative));
        const mask nearer = less(fabs(m), fabs(at)), after = less(*middle, next), goes_on = here & ~found & ~other;
        const real old = *middle;
        *middle = pick(other | (goes_on & nearer), next, *middle);
        *misses = pick(other | (goes_on & nearer), m, *misses);
        found |= other;
        // The bracket narrows about the nearest place so far.
        const mask to_low = goes_on & ((nearer & after) | (~nearer & ~after)), to_high = goes_on & ~((nearer & after) | (~nearer & ~after));
        const real edge = pick(nearer, old, next), value = pick(nearer, at, m);
        low = pick(to_low, edge, low);
        a = pick(to_low, value, a);
        high = pick(to_high, edge, high);
        c = pick(to_high, value, c);
    }
    return found;
}
