// A packet of LANES rays carried by one work-item. On a CPU driver that does not vectorise divergent loops a packet fills
// the vector unit; where work-items are vectorised already (GPUs, Intel's CPU runtime) LANES is 1 and everything is scalar.
//
// The build defines LANES (1, 4, 8 or 16) and REAL_IS_DOUBLE (0 or 1). From there on:
//   scalar   one number, real   one number per lane, mask   per lane 0 (false) or -1 (all bits, true),
//   R(1.5)   a literal of the right precision in every lane.
#if REAL_IS_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#define SCALAR double
#define INTEGER long
#define R(x) ((real)(x))
#define S(x) (x)
#define REAL_SMALLEST 2.2250738585072014e-308
#define REAL_LARGEST 1.7976931348623157e308
#define REAL_EPSILON 2.220446049250313e-16
#else
#define SCALAR float
#define INTEGER int
#define R(x) ((real)(x##f))
#define S(x) (x##f)
#define REAL_SMALLEST 1.17549435e-38f
#define REAL_LARGEST 3.40282347e38f
#define REAL_EPSILON 1.1920929e-7f
#endif

#include "device/direct.h"

// The type of a number of each lane.
#if LANES == 1
#define OF_LANES(type) type
#else
#define OF_LANES(type) JOIN(type, LANES)
#endif
typedef SCALAR scalar;
typedef OF_LANES(SCALAR) real;

#if LANES == 1
typedef int mask;
#define any_lane(m) ((m) != 0)
#define less(a, b) (-((a) < (b)))
#define less_equal(a, b) (-((a) <= (b)))
#define equal(a, b) (-((a) == (b)))
#define equal_ints(a, b) equal(a, b)
#define is_nan(a) (-((a) != (a)))
#define pick(m, yes, no) ((m) ? (yes) : (no))
#define to_reals(a) ((real)(a))
#define lanes_store(value, array) ((array)[0] = (value))
#define lanes_load(array) ((array)[0])
#define going_on(m) (~0)
#else
typedef OF_LANES(INTEGER) mask;
// PoCL's `any` tests lane after lane; a reduction becomes one or two instructions.
#if defined(__has_builtin) && !defined(INTERPRETED)
#if __has_builtin(__builtin_reduce_or)
#define any_lane(m) (__builtin_reduce_or(m) != 0)
#endif
#endif
#ifndef any_lane
#define any_lane(m) any(m)
#endif
#define less(a, b) ((real)(a) < (real)(b))
#define less_equal(a, b) ((real)(a) <= (real)(b))
#define equal(a, b) ((real)(a) == (real)(b))
#define equal_ints(a, b) ((a) == (b))
#define is_nan(a) ((a) != (a))
#ifdef DIRECT_BUILT_INS
// One of two numbers by the sign of a whole one as wide. For `m ? yes : no` clang makes three operations on bits in OpenCL, which its
// optimiser does not always put together again.
INLINE real direct_pick(mask m, real yes, real no) {
#if LANES == 4 && !REAL_IS_DOUBLE && defined(__AVX__) && __has_builtin(__builtin_ia32_blendvps)
    return __builtin_astype(__builtin_ia32_blendvps(no, yes, as_float4(m)), real);
#elif LANES == 8 && !REAL_IS_DOUBLE && defined(__AVX__) && __has_builtin(__builtin_ia32_blendvps256)
    return __builtin_astype(__builtin_ia32_blendvps256(no, yes, as_float8(m)), real);
#elif LANES == 4 && REAL_IS_DOUBLE && defined(__AVX__) && __has_builtin(__builtin_ia32_blendvpd256)
    return __builtin_astype(__builtin_ia32_blendvpd256(no, yes, as_double4(m)), real);
#elif LANES == 16 && !REAL_IS_DOUBLE && defined(__AVX512DQ__) && __has_builtin(__builtin_ia32_selectps_512)
    return __builtin_astype(__builtin_ia32_selectps_512(__builtin_ia32_cvtd2mask512(m), yes, no), real);
#elif LANES == 8 && REAL_IS_DOUBLE && defined(__AVX512DQ__) && __has_builtin(__builtin_ia32_selectpd_512)
    return __builtin_astype(__builtin_ia32_selectpd_512(__builtin_ia32_cvtq2mask512(m), yes, no), real);
#else
    return m ? yes : no;
#endif
}
#define pick(m, yes, no) direct_pick(m, (real)(yes), (real)(no))
#else
#define pick(m, yes, no) ((m) ? (real)(yes) : (real)(no))
#endif
#define to_reals(a) CONVERT(OF_LANES(SCALAR), a)
#define lanes_store(value, array) JOIN(vstore, LANES)(value, 0, array)
#define lanes_load(array) JOIN(vload, LANES)(0, array)
// Which lanes go on within a loop that ends when none does: of a single lane no compiler has to ask.
#define going_on(m) (m)
#endif
// The bits of numbers as whole ones, and back.
#define as_whole(a) JOIN(as_, OF_LANES(INTEGER))(a)
#define as_real(a) JOIN(as_, OF_LANES(SCALAR))(a)

// The smaller and the larger one of two, as one instruction of a processor, which fmin and fmax are not, since these look for NaN.
// Of a NaN here packets' `least` gives the second one and `most` the first: where the other one may be NaN, a number stands there.
#if LANES == 1
INLINE real least(real a, real b) { return fmin(a, b); }
INLINE real most(real a, real b) { return fmax(a, b); }
#else
INLINE real least(real a, real b) { return pick(less(a, b), a, b); }
INLINE real most(real a, real b) { return pick(less(a, b), b, a); }
#endif
// `a`, but at least `low` and then at most `high`.
INLINE real bounded(real a, real low, real high) { return least(most(low, a), high); }

// The processor's own estimate of 1/sqrt(a), where the compiler generates x86 code directly and names the instruction.
#if !REAL_IS_DOUBLE && defined(__has_builtin) && !defined(INTERPRETED)
#if LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_rsqrt14ps512_mask)
#define estimate_rsqrt(a) __builtin_ia32_rsqrt14ps512_mask(a, R(0.0), (ushort)(0xffff))
#elif LANES == 8 && defined(__AVX__) && __has_builtin(__builtin_ia32_rsqrtps256)
#define estimate_rsqrt(a) __builtin_ia32_rsqrtps256(a)
#elif LANES == 4 && defined(__SSE__) && __has_builtin(__builtin_ia32_rsqrtps)
#define estimate_rsqrt(a) __builtin_ia32_rsqrtps(a)
#endif
#endif

// Of functions that are called on a processor, and so compiled once: what a kernel does, since PoCL makes three functions of each
// kernel and inlines into all of them what it does; and long work for a packet that several kernels do. Functions that ask for the
// place of the work-item are inlined by PoCL in spite of it.
#ifdef DIRECT_BUILT_INS
#define CALLED static __attribute__((noinline))
#else
#define CALLED INLINE
#endif

// The count of a loop whose body copies structs. Where a driver loses such copies when it unrolls the loop, the count is one that
// its compiler cannot know. (COUNTS_AT_RUN_TIME is defined for such a driver: see `loses_copies_when_unrolling` in
// clfractal/device/quirks.py. The number of dimensions is 1, 2 or 3.)
#ifdef COUNTS_AT_RUN_TIME
#define TURNS(count) ((count) + (int)(get_work_dim() >> 2))
#else
#define TURNS(count) (count)
#endif

// Sum of a quantity over the lanes of a packet: of its halves, theirs, and so on.
INLINE scalar lanes_sum(real value) {
#if LANES == 1
    return value;
#else
#if LANES == 16
    const JOIN(SCALAR, 8) eight = value.lo + value.hi;
#elif LANES == 8
    const real eight = value;
#endif
#if LANES >= 8
    const JOIN(SCALAR, 4) four = eight.lo + eight.hi;
#else
    const real four = value;
#endif
    return (four.x + four.z) + (four.y + four.w);
#endif
}

// The largest of whole numbers of the lanes: of their halves, theirs, and so on.
#define LARGER(a, b) ((a) < (b) ? (b) : (a))
INLINE INTEGER lanes_most(mask value) {
#if LANES == 1
    return value;
#else
#if LANES == 16
    const JOIN(INTEGER, 8) eight = LARGER(value.lo, value.hi);
#elif LANES == 8
    const mask eight = value;
#endif
#if LANES >= 8
    const JOIN(INTEGER, 4) four = LARGER(eight.lo, eight.hi);
#else
    const mask four = value;
#endif
    const JOIN(INTEGER, 2) two = LARGER(four.lo, four.hi);
    return LARGER(two.x, two.y);
#endif
}

// The lanes of a packet as bits, lane i as 1 << i.
#define ALL_LANES ((1u << LANES) - 1u)
#define bits_count(bits) ((int)popcount((uint)(bits)))

#if LANES == 1
#define highest_bit(bits) 0
#define lanes_bits(m) ((uint)(m) & 1u)
#define lanes_of_bits(bits) (-(mask)(bits))
#else
#define highest_bit(bits) (31 - (int)clz((uint)(bits)))
#if LANES == 4
#define BIT_OF_LANE ((mask)(1, 2, 4, 8))
#elif LANES == 8
#define BIT_OF_LANE ((mask)(1, 2, 4, 8, 16, 32, 64, 128))
#else
#define BIT_OF_LANE ((mask)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768))
#endif
#define lanes_of_bits(bits) ((BIT_OF_LANE & (mask)((int)(bits))) != 0)

// In which lanes a mask is true. A processor has an instruction for that.
#if defined(DIRECT_BUILT_INS) && defined(__AVX512DQ__) && __has_builtin(__builtin_ia32_cvtd2mask512) && LANES == (REAL_IS_DOUBLE ? 8 : 16)
#if REAL_IS_DOUBLE
#define lanes_bits(m) ((uint)__builtin_ia32_cvtq2mask512(m))
#else
#define lanes_bits(m) ((uint)__builtin_ia32_cvtd2mask512(m))
#endif
#elif defined(DIRECT_BUILT_INS) && defined(__AVX__) && __has_builtin(__builtin_ia32_movmskps256) && LANES == (REAL_IS_DOUBLE ? 4 : 8)
#if REAL_IS_DOUBLE
#define lanes_bits(m) ((uint)__builtin_ia32_movmskpd256(as_double4(m)))
#else
#define lanes_bits(m) ((uint)__builtin_ia32_movmskps256(as_float8(m)))
#endif
#else
INLINE uint lanes_bits(mask m) {
    scalar each[LANES];
    lanes_store(pick(m, R(1.0), R(0.0)), each);
    uint bits = 0;
    for (int lane = 0; lane < LANES; ++lane) bits |= (each[lane] > S(0.0) ? 1u : 0u) << lane;
    return bits;
}
#endif
#endif

// The host's records (structs.h), and the constants of formulas, as functions are given them.
typedef __constant const struct Orbit *orbit_record;
typedef __constant const struct March *march_record;
typedef __constant const struct Material *material_record;
typedef __global const struct Light *light_record;
typedef __constant const struct View *view_record;
typedef __global const struct Object *object_record;
typedef __global const struct CutPlane *plane_record;
typedef __global const struct Map *map_record;
typedef __constant const scalar *constants;
