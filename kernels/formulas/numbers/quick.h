// Logarithms and powers of two as exact as distances need them.

// log2 to some 3e-7 for normal positive numbers, enough for a distance estimate: the exponent's bits, and the series of
// log2(m) = 2 artanh((m - 1) / (m + 1)) / log 2 for m in [1/sqrt 2, sqrt 2]. The built-in one, right to the last bit, would
// cost as much as several applications of a formula.
INLINE real quick_log2(real a) {
#if REAL_IS_DOUBLE
    return log2(a);
#else
    const mask bits = as_whole(a) - 0x3f3504f3;  // the bits of 1/sqrt 2
    const real exponent = to_reals(bits >> 23);
    const real m = as_real((bits & 0x007fffff) + 0x3f3504f3);
    const real s = (m - R(1.0)) / (m + R(1.0));
    const real s2 = s * s;
    return exponent + s * (R(2.8853900818) + s2 * (R(0.9617966939) + s2 * (R(0.5770780164) + s2 * R(0.4121985831))));
#endif
}

// 2**a to some 2e-7 of it, exact for whole numbers, within what normal numbers hold.
INLINE real quick_exp2(real a) {
#if REAL_IS_DOUBLE
    return exp2(a);
#else
    const real within = bounded(a, R(-126.0), R(126.0));
    const real whole = floor(within), part = within - whole;
    const real mantissa = R(1.0) + part * (R(0.6931530) + part * (R(0.2401475) + part * (R(0.0558534) + part * (R(0.0089505) +
                          part * R(0.0018956)))));
    return mantissa * as_real((as_whole(whole + R(12582912.0)) - (0x4b400000 - 127)) << 23);  // 1.5 * 2^23 makes it whole
#endif
}
