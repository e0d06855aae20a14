// Powers whose exponent is data, the same for all lanes: a whole exponent by repeated squaring, any other by logarithm and angles.
//
// `twice` is 2 n where that is a whole number (|n| up to 1024), else 0: even for whole exponents, odd for those that are a half more.
#include "dual.h"

typedef struct {
    real re, im;
} complex_real;
typedef struct {
    dual re, im;
} complex_dual;

// The bit below the highest one of a number above 0: where repeated squaring goes on after the first factor.
INLINE int second_bit(int n) { return (1 << (31 - clz(n))) >> 1; }

INLINE real whole_power(real x, int n) {
    real power = x;
    for (int bit = second_bit(n); bit != 0; bit >>= 1) {
        power = power * power;
        if (n & bit) power = power * x;
    }
    return power;
}

// x^n; 0 where x < 0 has no real power.
INLINE real real_raised(real x, scalar n, int twice) {
    if (twice == 0 || (twice < 0 && (twice & 1))) return real_pow(x, (real)(n));
    if (twice == 1) return real_sqrt(x);
    const real power = whole_power(x, (twice < 0 ? -twice : twice) >> 1);
    if (twice & 1) return power * real_sqrt(x);
    return twice < 0 ? R(1.0) / power : power;
}

// d(x^n)/dx, 0 where it is not finite.
INLINE real real_raised_slope(real x, scalar n, int twice) {
    return real_finite_or_zero((real)(n) * real_raised(x, n - S(1.0), twice == 0 ? 0 : twice - 2));
}

INLINE dual dual_raised(dual x, scalar n, int twice) {
    return dual_chain(real_raised(x.v, n, twice), real_raised_slope(x.v, n, twice), x);
}

// (x + iy)^n by modulus and angle; 0 at the origin, but 1 for n = 0.
CALLED void turned_power(const real *x, const real *y, scalar n, complex_real *power) {
    const real square = *x * *x + *y * *y;
    const real modulus = pick(less(R(0.0), square), real_pow(square, (real)(S(0.5) * n)), (real)(n == S(0.0) ? S(1.0) : S(0.0)));
    const real angle = real_atan2(*y, *x) * (real)(n);
    power->re = modulus * cos(angle);
    power->im = modulus * sin(angle);
}

INLINE complex_real turned(real x, real y, scalar n) {
    complex_real power;
    turned_power(&x, &y, n, &power);
    return power;
}

// 1/w where the exponent is negative; 0 at the origin.
INLINE complex_real inverse_where(complex_real w, int over) {
    if (!over) return w;
    const real square = w.re * w.re + w.im * w.im;
    const mask some = less(R(0.0), square);
    return (complex_real){pick(some, w.re / square, R(0.0)), pick(some, -(w.im / square), R(0.0))};
}

// (x + iy)^n.
INLINE complex_real complex_raised(real x, real y, scalar n, int twice) {
    if (twice == 0 || (twice & 1)) return turned(x, y, n);
    complex_real w = {x, y};
    const int whole = (twice < 0 ? -twice : twice) >> 1;
    for (int bit = second_bit(whole); bit != 0; bit >>= 1) {
        // (re + im)(re - im) cancels less than re^2 - im^2.
        const real re = (w.re + w.im) * (w.re - w.im), product = w.re * w.im, im = product + product;
        if (whole & bit) {
            w.re = re * x - im * y;
            w.im = re * y + im * x;
        } else {
            w.re = re;
            w.im = im;
        }
    }
    return inverse_where(w, twice < 0);
}

// (x + i root)^n with root = sqrt(square): its imaginary part is a share of the root, so that nothing waits for it.
INLINE complex_real complex_raised_root(real x, real square, real root, scalar n, int twice) {
    if (twice == 0 || (twice & 1)) return turned(x, root, n);
    real re = x, share = R(1.0);
    const int whole = (twice < 0 ? -twice : twice) >> 1;
    for (int bit = second_bit(whole); bit != 0; bit >>= 1) {
        const real squared = re * re - square * (share * share), product = re * share, doubled = product + product;
        if (whole & bit) {
            re = squared * x - square * doubled;
            share = doubled * x + squared;
        } else {
            re = squared;
            share = doubled;
        }
    }
    const complex_real w = {re, share * root};
    return inverse_where(w, twice < 0);
}

// Its slope is n w^n / w, 0 at the origin.
INLINE complex_dual dual_complex_raised(dual x, dual y, scalar n, int twice) {
    const complex_real w = complex_raised(x.v, y.v, n, twice);
    const real square = x.v * x.v + y.v * y.v;
    const real part = pick(less(R(0.0), square), (real)(n) / square, R(0.0));
    const real u = (w.re * x.v + w.im * y.v) * part, v = (w.im * x.v - w.re * y.v) * part;
    return (complex_dual){dual_chain2(w.re, u, x, -v, y), dual_chain2(w.im, v, x, u, y)};
}
