// Built-in functions that some drivers compute wrongly for packets, replaced under their own names, so that other files
// need not know. Most are faults where an unusual argument in one lane spoils its neighbours; where that cannot matter (LANES
// is 1) nothing is changed. `clfractal/device/lane_probe.py` tries packets of mixed lanes on every device.
#include "device/lanes.h"

#if !REAL_IS_DOUBLE
// SLEEF again: where denormal numbers count as zero, pow of a denormal number is meaningless (1.4e-45 ^ 2 = 1.9e-4).
INLINE real normal_pow(real x, real y) { return pow(pick(less(fabs(x), (real)(REAL_SMALLEST)), x * R(0.0), x), y); }
#undef pow
#define pow(x, y) normal_pow(x, y)
#endif

#if LANES > 1

#if !REAL_IS_DOUBLE
// SLEEF, the vector mathematics of PoCL 3.0 and 3.1: once any lane's argument is beyond some 1e5, small arguments in the
// others come out wrong (sin(1e-10) = 0.0134 for float4 to float16). Far lanes are evaluated among themselves.
INLINE mask far_lanes(real a) { return ~less_equal(fabs(a), R(1e5)); }

#define APART_WHERE_FAR(name, function)                                        \
    INLINE real name(real a) {                                                 \
        const mask far = far_lanes(a);                                         \
        const real near = function(pick(far, R(0.0), a));                      \
        if (!any_lane(far)) return near;                                       \
        return pick(far, function(pick(far, a, R(1e6))), near);                \
    }
APART_WHERE_FAR(packet_sin, sin)
APART_WHERE_FAR(packet_cos, cos)
APART_WHERE_FAR(packet_tan, tan)

// Some drivers' own built-ins are macros.
#undef sin
#undef cos
#undef tan
#define sin(a) packet_sin(a)
#define cos(a) packet_cos(a)
#define tan(a) packet_tan(a)
#endif

#if REAL_IS_DOUBLE && LANES >= 8
// The same, pow of double8 with AVX-512: a lane whose base is 0, denormal or infinite spoils another one, whose power loses its binary
// exponent (0.49^30 = 0.68). Such lanes are evaluated one by one.
INLINE real packet_pow(real x, real y) {
    const mask usual = less_equal((real)(REAL_SMALLEST), fabs(x)) & less_equal(fabs(x), (real)(REAL_LARGEST));
    const real power = pow(pick(usual, x, R(1.0)), y);
    if (!any_lane(~usual)) return power;
    scalar base[LANES], exponent[LANES], each[LANES], is_usual[LANES];
    lanes_store(x, base);
    lanes_store(y, exponent);
    lanes_store(power, each);
    lanes_store(pick(usual, R(1.0), R(0.0)), is_usual);
    for (int lane = 0; lane < LANES; ++lane) {
        if (is_usual[lane] == 0) each[lane] = pow(base[lane], exponent[lane]);
    }
    return lanes_load(each);
}

#undef pow
#define pow(x, y) packet_pow(x, y)
#endif

#endif
