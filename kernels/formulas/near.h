// A number of an orbit beside that of a place, which is known in all digits, and an application of a formula to such numbers: as a list of
// operations (`clfractal/formulas/recorder.py`). Differences are found without cancellation, so they may be of any size. Where a point and
// the place go different ways, comparisons decide by the place's exact difference, and the difference of both ways joins that of the point.
// (Differences: Pauldelbrot and others, perturbation of Mandelbrot sets, fractalforums.com 2013; here of every operation of the language.)
typedef struct {
    real v;           // the value
    real d;           // less the place's own
    real dx, dy, dz;  // how it changes with the point
} near;

#define NEAR_OPERATION 6  // numbers of an operation: where it goes, its code, its operands, its constant

// What a smooth function gives: its slope halfway between both, and at the point. (Differences are small here.)
INLINE near near_smooth(real own, near a, real between, real slope) {
    const real d = between * a.d;
    return (near){own + d, d, slope * a.dx, slope * a.dy, slope * a.dz};
}

#define NEAR_SMOOTH(slope) \
    { \
        real x = a.v - R(0.5) * a.d; \
        const real between = slope; \
        x = a.v; \
        return near_smooth(own, a, between, slope); \
    }

INLINE near near_sum(real own, near a, near b, real sign) {
    const real d = a.d + sign * b.d;
    return (near){own + d, d, a.dx + sign * b.dx, a.dy + sign * b.dy, a.dz + sign * b.dz};
}

INLINE near near_product(real own, near a, near b) {
    const real d = a.v * b.d + (b.v - b.d) * a.d;
    return (near){own + d, d, a.v * b.dx + b.v * a.dx, a.v * b.dy + b.v * a.dy, a.v * b.dz + b.v * a.dz};
}

INLINE near near_quotient(real own, near a, near b) {
    const real d = (a.d - own * b.d) / b.v, v = own + d;
    return (near){v, d, (a.dx - v * b.dx) / b.v, (a.dy - v * b.dy) / b.v, (a.dz - v * b.dz) / b.v};
}

INLINE near near_root(real own, near a) {
    const real both = sqrt(fmax(a.v, R(0.0))) + own;
    const mask there = less(R(0.0), both);
    const real d = pick(there, a.d / both, R(0.0)), v = own + d;
    const real slope = pick(less(R(0.0), v), R(0.5) / v, R(0.0));
    return (near){v, d, slope * a.dx, slope * a.dy, slope * a.dz};
}

INLINE near near_angle(real own, near y, near x) {
    const real own_x = x.v - x.d, own_y = y.v - y.d, square = x.v * x.v + y.v * y.v;
    const real share = pick(less(R(0.0), square), R(1.0) / square, R(0.0)), fx = -y.v * share, fy = x.v * share;
    const real d = atan2(own_x * y.d - own_y * x.d, own_x * x.v + own_y * y.v);
    return (near){own + d, d, fy * y.dx + fx * x.dx, fy * y.dy + fx * x.dy, fy * y.dz + fx * x.dz};
}

// A number without slopes.
INLINE near near_level(real own, real v) { return (near){v, v - own, R(0.0), R(0.0), R(0.0)}; }

INLINE real near_truth(mask m) { return pick(m, R(1.0), R(0.0)); }

// `own` is the difference of both arms at the place.
INLINE near near_where(real own, near chosen, near a, near b) {
    const mask here = less(R(0.5), chosen.v), there = less(R(0.5), chosen.v - chosen.d);
    const real d = pick(here, a.d + pick(there, R(0.0), own), b.d - pick(there, own, R(0.0)));
    return (near){pick(here, a.v, b.v), d, pick(here, a.dx, b.dx), pick(here, a.dy, b.dy), pick(here, a.dz, b.dz)};
}

CALLED near near_operation(int code, real own, near a, near b, near c, real exponent) {
    switch (code) {
    case NEAR_CONST: return (near){own, R(0.0), R(0.0), R(0.0), R(0.0)};
    case NEAR_ADD: return near_sum(own, a, b, R(1.0));
    case NEAR_SUB: return near_sum(own, a, b, R(-1.0));
    case NEAR_MUL: return near_product(own, a, b);
    case NEAR_DIV: return near_quotient(own, a, b);
    case NEAR_NEG: return (near){-a.v, -a.d, -a.dx, -a.dy, -a.dz};
    case NEAR_SQRT: return near_root(own, a);
    case NEAR_EXP: NEAR_SMOOTH(exp(x))
    case NEAR_LOG: NEAR_SMOOTH(R(1.0) / x)
    case NEAR_SIN: NEAR_SMOOTH(cos(x))
    case NEAR_COS: NEAR_SMOOTH(-sin(x))
    case NEAR_TAN: NEAR_SMOOTH(R(1.0) + tan(x) * tan(x))
    case NEAR_ASIN: NEAR_SMOOTH(R(1.0) / sqrt(R(1.0) - x * x))
    case NEAR_ACOS: NEAR_SMOOTH(R(-1.0) / sqrt(R(1.0) - x * x))
    case NEAR_ATAN: NEAR_SMOOTH(R(1.0) / (R(1.0) + x * x))
    case NEAR_ATAN2: return near_angle(own, a, b);
    case NEAR_POW: NEAR_SMOOTH(exponent * pow(x, exponent - R(1.0)))
    case NEAR_FLOOR: return near_level(own, floor(a.v));
    case NEAR_SIGN: return near_level(own, near_truth(less(R(0.0), a.v)) - near_truth(less(a.v, R(0.0))));
    case NEAR_LT: return near_level(near_truth(less(own, R(0.0))), near_truth(less(own + (a.d - b.d), R(0.0))));
    case NEAR_LE: return near_level(near_truth(less_equal(own, R(0.0))), near_truth(less_equal(own + (a.d - b.d), R(0.0))));
    case NEAR_EQ: return near_level(near_truth(equal(own, R(0.0))), near_truth(equal(own + (a.d - b.d), R(0.0))));
    case NEAR_AND: return near_level(own, a.v * b.v);
    case NEAR_NOT: return near_level(own, R(1.0) - a.v);
    default: return near_where(own, a, b, c);
    }
}

// Does a list of operations. `own`: what the place has of each.
INLINE void near_run(near *kept, __constant const scalar *list, int count, __constant const scalar *own) {
    for (int i = 0; i < count; ++i, list += NEAR_OPERATION) {
        const near a = kept[(int)list[2]], b = kept[(int)list[3]], c = kept[(int)list[4]];
        kept[(int)list[0]] = near_operation((int)list[1], (real)(own[i]), a, b, c, (real)(list[5]));
    }
}
