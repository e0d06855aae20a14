// The number type `dual`: a value and its three partial derivatives by the coordinates of the point in space.
// Forward-mode differentiation: Griewank & Walther, Evaluating Derivatives, 2nd ed. (SIAM 2008), ch. 3.
// An operation whose other operand is constant in space takes it as a plain `real` and spends no partials on it.
typedef struct {
    real v;           // value
    real dx, dy, dz;  // partials by x, y and z of the point
} dual;

// The dual number with value `v` whose partials are those of `a`, scaled: the chain rule for a function of one number.
INLINE dual dual_chain(real v, real slope, dual a) { return (dual){v, slope * a.dx, slope * a.dy, slope * a.dz}; }

// The chain rule for a function of two numbers with partials `fa` and `fb`.
INLINE dual dual_chain2(real v, real fa, dual a, real fb, dual b) {
    return (dual){v, fa * a.dx + fb * b.dx, fa * a.dy + fb * b.dy, fa * a.dz + fb * b.dz};
}

// One more product of the chain rule, which is added: rows of a map's Jacobian times the J carried along are made of these. A row begins
// with that of the last number, and with a coordinate of the point that is added to the value: it has the partials 1, 0, 0 and so on.
INLINE dual dual_more(dual sum, real fa, dual a) { return (dual){sum.v, fa * a.dx + sum.dx, fa * a.dy + sum.dy, fa * a.dz + sum.dz}; }
INLINE dual dual_chain_x(real v, real slope, dual a) { return (dual){v, slope * a.dx + R(1.0), slope * a.dy, slope * a.dz}; }
INLINE dual dual_chain_y(real v, real slope, dual a) { return (dual){v, slope * a.dx, slope * a.dy + R(1.0), slope * a.dz}; }
INLINE dual dual_chain_z(real v, real slope, dual a) { return (dual){v, slope * a.dx, slope * a.dy, slope * a.dz + R(1.0)}; }

// The same partials with another value: of a product and a sum that are rounded once.
INLINE dual dual_with(dual a, real v) { return (dual){v, a.dx, a.dy, a.dz}; }

INLINE dual dual_constant(real v) { return (dual){v, R(0.0), R(0.0), R(0.0)}; }

// The coordinates of the point themselves, and adding one of them: partials 1, 0, 0 and so on.
INLINE dual dual_coordinate_x(real v) { return (dual){v, R(1.0), R(0.0), R(0.0)}; }
INLINE dual dual_coordinate_y(real v) { return (dual){v, R(0.0), R(1.0), R(0.0)}; }
INLINE dual dual_coordinate_z(real v) { return (dual){v, R(0.0), R(0.0), R(1.0)}; }
INLINE dual dual_add_coordinate_x(dual a, real v) { return (dual){a.v + v, a.dx + R(1.0), a.dy, a.dz}; }
INLINE dual dual_add_coordinate_y(dual a, real v) { return (dual){a.v + v, a.dx, a.dy + R(1.0), a.dz}; }
INLINE dual dual_add_coordinate_z(dual a, real v) { return (dual){a.v + v, a.dx, a.dy, a.dz + R(1.0)}; }
INLINE dual dual_add(dual a, dual b) { return (dual){a.v + b.v, a.dx + b.dx, a.dy + b.dy, a.dz + b.dz}; }
INLINE dual dual_sub(dual a, dual b) { return (dual){a.v - b.v, a.dx - b.dx, a.dy - b.dy, a.dz - b.dz}; }
INLINE dual dual_mul(dual a, dual b) { return dual_chain2(a.v * b.v, b.v, a, a.v, b); }
INLINE dual dual_neg(dual a) { return (dual){-a.v, -a.dx, -a.dy, -a.dz}; }

INLINE dual dual_div(dual a, dual b) {
    const real inverse = R(1.0) / b.v;
    const real quotient = a.v / b.v;
    return dual_chain2(quotient, inverse, a, -quotient * inverse, b);
}

INLINE dual dual_add_real(dual a, real b) { return (dual){a.v + b, a.dx, a.dy, a.dz}; }
INLINE dual dual_sub_real(dual a, real b) { return (dual){a.v - b, a.dx, a.dy, a.dz}; }
INLINE dual real_sub_dual(real a, dual b) { return (dual){a - b.v, -b.dx, -b.dy, -b.dz}; }
INLINE dual dual_mul_real(dual a, real b) { return dual_chain(a.v * b, b, a); }
INLINE dual dual_div_real(dual a, real b) { return dual_chain(a.v / b, R(1.0) / b, a); }
INLINE dual real_div_dual(real a, dual b) {
    const real quotient = a / b.v;
    return dual_chain(quotient, -quotient / b.v, b);
}

// A square costs fewer multiplications than a product of two different numbers.
INLINE dual dual_square(dual a) { return dual_chain(a.v * a.v, a.v + a.v, a); }

INLINE dual dual_where(mask m, dual yes, dual no) {
    return (dual){pick(m, yes.v, no.v), pick(m, yes.dx, no.dx), pick(m, yes.dy, no.dy), pick(m, yes.dz, no.dz)};
}

// Slopes at a kink are one-sided or 0: anything finite is right there, NaN is not.
INLINE dual dual_abs(dual a) { return dual_chain(fabs(a.v), real_sign(a.v), a); }
INLINE dual dual_sign(dual a) { return dual_constant(real_sign(a.v)); }
INLINE dual dual_floor(dual a) { return dual_constant(floor(a.v)); }
INLINE dual dual_min(dual a, dual b) { return dual_where(less_equal(a.v, b.v) | is_nan(b.v), a, b); }
INLINE dual dual_max(dual a, dual b) { return dual_where(less_equal(b.v, a.v) | is_nan(b.v), a, b); }
INLINE dual dual_clamp(dual a, dual low, dual high) { return dual_min(dual_max(a, low), high); }
INLINE dual dual_mod(dual a, dual b) {
    const real turns = floor(a.v / b.v);
    return dual_chain2(a.v - b.v * turns, R(1.0), a, -turns, b);
}

// 0 with slope 0 at and below 0: the slope of the square root is infinite at 0.
INLINE dual dual_sqrt(dual a) {
    const real root = real_sqrt(a.v);
    return dual_chain(root, pick(less(R(0.0), root), R(0.5) / root, R(0.0)), a);
}

INLINE dual dual_rsqrt(dual a) {
    const real root = real_rsqrt(a.v);
    return dual_chain(root, R(-0.5) * root * (root * root), a);
}

INLINE dual dual_exp(dual a) {
    const real value = exp(a.v);
    return dual_chain(value, value, a);
}

INLINE dual dual_log(dual a) { return dual_chain(real_log(a.v), pick(less((real)(LOG_SMALLEST), a.v), R(1.0) / a.v, R(0.0)), a); }
INLINE dual dual_sin(dual a) { return dual_chain(sin(a.v), cos(a.v), a); }
INLINE dual dual_cos(dual a) { return dual_chain(cos(a.v), -sin(a.v), a); }
INLINE dual dual_tan(dual a) {
    const real value = tan(a.v);
    return dual_chain(value, R(1.0) + value * value, a);
}

INLINE dual dual_asin(dual a) { return dual_chain(real_asin(a.v), real_arc_slope(a.v), a); }
INLINE dual dual_acos(dual a) { return dual_chain(real_acos(a.v), -real_arc_slope(a.v), a); }
INLINE dual dual_atan(dual a) { return dual_chain(atan(a.v), R(1.0) / (R(1.0) + a.v * a.v), a); }

// 0 with slope 0 at the origin.
INLINE dual dual_atan2(dual y, dual x) {
    const real square = x.v * x.v + y.v * y.v;
    const real inverse = pick(less(R(0.0), square), R(1.0) / square, R(0.0));
    return dual_chain2(real_atan2(y.v, x.v), x.v * inverse, y, -y.v * inverse, x);
}

// d(x^y) = y x^(y-1) dx + x^y log x dy.
INLINE dual dual_pow_real(dual x, real y) { return dual_chain(real_pow(x.v, y), real_power_slope(x.v, y), x); }
INLINE dual dual_pow(dual x, dual y) {
    const real value = real_pow(x.v, y.v);
    return dual_chain2(value, real_power_slope(x.v, y.v), x, real_power_log(value, x.v), y);
}
