// The number type `real`: a plain number per lane. Every operation is total: where mathematics has no value a finite one is
// chosen (the choices are listed with each operation), so that a point never turns into NaN by itself.
#include "device/repairs.h"

INLINE real real_add(real a, real b) { return a + b; }
INLINE real real_sub(real a, real b) { return a - b; }
INLINE real real_mul(real a, real b) { return a * b; }
// A product and a sum in one expression, which compilers make one operation where the device has it (FP_CONTRACT is on).
INLINE real real_fma(real a, real b, real c) { return a * b + c; }
INLINE real real_fms(real a, real b, real c) { return a * b - c; }
INLINE real real_fnma(real a, real b, real c) { return c - a * b; }
INLINE real real_div(real a, real b) { return a / b; }
INLINE real real_neg(real a) { return -a; }
INLINE real real_abs(real a) { return fabs(a); }
INLINE real real_min(real a, real b) { return fmin(a, b); }
INLINE real real_max(real a, real b) { return fmax(a, b); }
INLINE real real_clamp(real a, real low, real high) { return fmin(fmax(a, low), high); }
// The same between bounds that are numbers.
INLINE real real_bounded(real a, real low, real high) { return bounded(a, low, high); }
INLINE real real_floor(real a) { return floor(a); }
INLINE real real_mod(real a, real b) { return a - b * floor(a / b); }
INLINE real real_exp(real a) { return exp(a); }
INLINE real real_sin(real a) { return sin(a); }
INLINE real real_cos(real a) { return cos(a); }
INLINE real real_tan(real a) { return tan(a); }
INLINE real real_atan(real a) { return atan(a); }
INLINE real real_where(mask m, real yes, real no) { return pick(m, yes, no); }

// -1, 0 or 1; 0 at 0 and at NaN.
INLINE real real_sign(real a) { return pick(less(R(0.0), a), R(1.0), pick(less(a, R(0.0)), R(-1.0), R(0.0))); }

// 0 below 0.
INLINE real real_sqrt(real a) { return sqrt(most(R(0.0), a)); }

// 1/sqrt(a): infinite at 0 and below, where real_sqrt is 0; 0 at infinity. Within 2 ulp, as OpenCL demands of its rsqrt,
// which on processors is a root and a division, one waiting for the other.
INLINE real real_rsqrt(real a) {
#ifdef estimate_rsqrt
    // One step of Newton's iteration squares the error of the processor's own estimate, which is exact at 0 and infinity.
    const real positive = most(R(0.0), a);
    const real y = estimate_rsqrt(positive);
    const real refined = y + (R(0.5) * y) * (R(1.0) - (positive * y) * y);
    const mask usual = less_equal((real)(REAL_SMALLEST), positive) & less_equal(positive, (real)(REAL_LARGEST));
    return pick(usual, refined, y);
#else
    return R(1.0) / sqrt(most(R(0.0), a));
#endif
}

// The logarithm of the smallest normal float at and below 0, in every precision, so that all agree.
#define LOG_SMALLEST S(1.1754943508222875e-38)
INLINE real real_log(real a) { return log(most((real)(LOG_SMALLEST), a)); }

// Arguments outside [-1, 1] count as the nearer end.
INLINE real real_asin(real a) { return asin(real_clamp(a, R(-1.0), R(1.0))); }
INLINE real real_acos(real a) { return acos(real_clamp(a, R(-1.0), R(1.0))); }

// 0 at the origin, whatever the signs of the zeros.
INLINE real real_atan2(real y, real x) { return pick(equal(x, R(0.0)) & equal(y, R(0.0)), R(0.0), atan2(y, x)); }

// x^y for an exponent that is not a constant whole number; 0 where x < 0 has no real power.
INLINE real real_pow(real x, real y) {
    const real power = pow(x, y);
    return pick(is_nan(power), R(0.0), power);
}

// Slopes that a finite value stands for where the true one is infinite or does not exist.
INLINE real real_finite_or_zero(real a) { return pick(less_equal(fabs(a), (real)(REAL_LARGEST)), a, R(0.0)); }

// d asin(a)/da, 0 at and beyond the ends of [-1, 1].
INLINE real real_arc_slope(real a) {
    const real square = (R(1.0) - a) * (R(1.0) + a);
    return pick(less(R(0.0), square), R(1.0) / sqrt(square), R(0.0));
}

// d(x^y)/dx = y x^(y-1), and d(x^y)/dy = x^y log x given x^y; 0 where they are not finite.
INLINE real real_power_slope(real x, real y) { return real_finite_or_zero(y * real_pow(x, y - R(1.0))); }
INLINE real real_power_log(real power, real x) { return real_finite_or_zero(power * real_log(x)); }
