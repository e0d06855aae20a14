// A packet of LANES rays carried by one work-item. On a CPU driver that does not vectorise divergent loops a packet fills
// the vector unit; where work-items are vectorised already (GPUs, Intel's CPU runtime) LANES is 1 and everything is scalar.
//
// The build defines LANES (1, 4, 8 or 16) and REAL_IS_DOUBLE (0 or 1). From there on:
//   scalar   one number, real   one number per lane, mask   per lane 0 (false) or -1 (all bits, true),
//   R(1.5)   a literal of the right precision in every lane.
#if REAL_IS_DOUBLE
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
typedef double scalar;
#define R(x) ((real)(x))
#define S(x) (x)
#define REAL_SMALLEST 2.2250738585072014e-308
#define REAL_LARGEST 1.7976931348623157e308
#define REAL_EPSILON 2.220446049250313e-16
#else
typedef float scalar;
#define R(x) ((real)(x##f))
#define S(x) (x##f)
#define REAL_SMALLEST 1.17549435e-38f
#define REAL_LARGEST 3.40282347e38f
#define REAL_EPSILON 1.1920929e-7f
#endif

#include "direct.h"

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

#if LANES == 1
typedef scalar real;
typedef int mask;
#define any_lane(m) ((m) != 0)
#define as_mask(a) as_int(a)  // of float: the bits, as whole numbers
#define as_real(a) as_float(a)
#define real_of_mask(a) ((scalar)(a))
#define less(a, b) (-((a) < (b)))
#define less_equal(a, b) (-((a) <= (b)))
#define equal(a, b) (-((a) == (b)))
#define is_nan(a) (-((a) != (a)))
#define pick(m, yes, no) ((m) ? (yes) : (no))
#define lanes_store(value, array) ((array)[0] = (value))
#define lanes_load(array) ((array)[0])
#else
#if REAL_IS_DOUBLE
typedef JOIN(double, LANES) real;
typedef JOIN(long, LANES) mask;
#else
typedef JOIN(float, LANES) real;
typedef JOIN(int, LANES) mask;
#endif
// PoCL's `any` tests lane after lane; a reduction becomes one or two instructions.
#if defined(__has_builtin) && !defined(INTERPRETED)
#if __has_builtin(__builtin_reduce_or)
#define any_lane(m) (__builtin_reduce_or(m) != 0)
#endif
#endif
#ifndef any_lane
#define any_lane(m) any(m)
#endif
#define as_mask(a) JOIN(as_int, LANES)(a)
#define as_real(a) JOIN(as_float, LANES)(a)
#define real_of_mask(a) JOIN(convert_float, LANES)(a)
#define less(a, b) ((real)(a) < (real)(b))
#define less_equal(a, b) ((real)(a) <= (real)(b))
#define equal(a, b) ((real)(a) == (real)(b))
#define is_nan(a) ((a) != (a))
#ifdef DIRECT_BUILT_INS
#define pick(m, yes, no) direct_pick(m, (real)(yes), (real)(no))
#else
#define pick(m, yes, no) ((m) ? (real)(yes) : (real)(no))
#endif
#define lanes_store(value, array) JOIN(vstore, LANES)(value, 0, array)
#define lanes_load(array) JOIN(vload, LANES)(0, array)
#endif

// The smaller and the larger one, where neither is NaN: as one instruction, which fmin and fmax are not.
#define least(a, b) pick(less(a, b), a, b)
#define most(a, b) pick(less(a, b), b, a)

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

// Every helper is meant to vanish into its caller: a call per packet operation would cost more than the operation.
// (INTERPRETED is defined for a driver that cannot: see `cannot_run_optimised_code` in clfractal/device/select.py.)
#ifdef INTERPRETED
#define INLINE static inline
#else
#define INLINE static inline __attribute__((always_inline))
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
// clfractal/device/select.py. The number of dimensions is 1, 2 or 3.)
#ifdef COUNTS_AT_RUN_TIME
#define TURNS(count) ((count) + (int)(get_work_dim() >> 2))
#else
#define TURNS(count) (count)
#endif

// Sum of a quantity over the lanes of a packet.
INLINE scalar lanes_sum(real value) {
    scalar each[LANES];
    lanes_store(value, each);
    scalar sum = 0;
    for (int lane = 0; lane < LANES; ++lane) sum += each[lane];
    return sum;
}

// In how many lanes a mask is true.
INLINE int lanes_count(mask m) {
#if LANES == 1
    return m ? 1 : 0;
#elif defined(__has_builtin) && !defined(INTERPRETED)
#if __has_builtin(__builtin_reduce_add)
    return -(int)__builtin_reduce_add(m);
#else
    return (int)lanes_sum(pick(m, R(1.0), R(0.0)));
#endif
#else
    return (int)lanes_sum(pick(m, R(1.0), R(0.0)));
#endif
}

#include "repairs.h"
