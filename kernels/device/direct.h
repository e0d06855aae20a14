// Built-in functions as operations of the compiler, so that kernels call nothing of a driver's library.

// Every helper is meant to vanish into its caller: a call per packet operation would cost more than the operation.
// (INTERPRETED is defined for a driver that cannot: see `cannot_run_optimised_code` in clfractal/device/quirks.py.)
#ifdef INTERPRETED
#define INLINE static inline
#else
#define INLINE static inline __attribute__((always_inline))
#endif

// Built-in functions written in the compiler's own operations, under the built-ins' own names.
//
// A CPU driver brings its built-in functions as a library of compiled code. Where that library was compiled for other features
// than the processor has in the compiler's eyes (PoCL's for AVX-512, and LLVM does not know that this processor has it), no
// function of it can be inlined: each minimum becomes a call, which costs as much as ten minima and spills all registers. Worse,
// a vector of 16 floats is passed in another way than such a function expects. The operations here are instructions everywhere.
//
// Only for packets, and where the compiler generates code for the processor directly. Other drivers (of GPUs, and Intel's)
// inline their own built-ins, and Oclgrind (INTERPRETED) does not know the operations.
#if LANES != 1 && defined(__clang__) && defined(__has_builtin) && (defined(__x86_64__) || defined(__aarch64__)) && !defined(INTERPRETED)
#define DIRECT_BUILT_INS
#endif

#ifdef DIRECT_BUILT_INS
// Functions that are always inlined may have vectors of any width as arguments: nothing is passed.
#pragma clang diagnostic ignored "-Wpsabi"
#define DIRECT static inline __attribute__((always_inline, overloadable))

// Memory: vectors are loaded and stored at addresses that are aligned for single numbers only.
#define DIRECT_MEMORY(type, width)                                                                                          \
    typedef type##width loose_##type##width __attribute__((aligned(sizeof(type))));                                         \
    DIRECT type##width direct_load##width(const __private type *p) { return *(const __private loose_##type##width *)p; }     \
    DIRECT type##width direct_load##width(const __global type *p) { return *(const __global loose_##type##width *)p; }       \
    DIRECT type##width direct_load##width(const __constant type *p) { return *(const __constant loose_##type##width *)p; }   \
    DIRECT void direct_store##width(type##width value, __private type *p) { *(__private loose_##type##width *)p = value; }   \
    DIRECT void direct_store##width(type##width value, __global type *p) { *(__global loose_##type##width *)p = value; }

// Whole numbers. `max` is the second one where the first is smaller, so that real numbers could use it too.
#define DIRECT_ORDER(type)                                               \
    DIRECT type direct_min(type a, type b) { return b < a ? b : a; }     \
    DIRECT type direct_max(type a, type b) { return a < b ? b : a; }
#define DIRECT_WHOLE(type)                                               \
    DIRECT_ORDER(type)                                                   \
    DIRECT type direct_clamp(type a, type low, type high) { return direct_min(direct_max(a, low), high); }

// Real numbers: if one of two is NaN, fmin and fmax give the other.
#if __has_builtin(__builtin_elementwise_max) && __has_builtin(__builtin_elementwise_min)
#define DIRECT_FMIN(a, b) __builtin_elementwise_min(a, b)
#define DIRECT_FMAX(a, b) __builtin_elementwise_max(a, b)
#else
#define DIRECT_FMIN(a, b) (a != a ? b : b < a ? b : a)
#define DIRECT_FMAX(a, b) (a != a ? b : a < b ? b : a)
#endif
#if __has_builtin(__builtin_elementwise_floor)
#define DIRECT_FLOOR(type) DIRECT type direct_floor(type a) { return __builtin_elementwise_floor(a); }
#else
#define DIRECT_FLOOR(type)
#endif
#define DIRECT_ROUNDED_APART _Pragma("clang fp contract(off)")  // as the libraries do it: pictures keep their bits
#define DIRECT_REAL(type, bits, sign)                                                                                   \
    DIRECT_ORDER(type)                                                                                                  \
    DIRECT_FLOOR(type)                                                                                                  \
    DIRECT type direct_fmin(type a, type b) { return DIRECT_FMIN(a, b); }                                               \
    DIRECT type direct_fmax(type a, type b) { return DIRECT_FMAX(a, b); }                                               \
    DIRECT type direct_clamp(type a, type low, type high) { return direct_fmin(direct_fmax(a, low), high); }            \
    DIRECT type direct_mix(type a, type b, type share) {                                                                \
        DIRECT_ROUNDED_APART                                                                                            \
        return a + (b - a) * share;                                                                                     \
    }                                                                                                                   \
    DIRECT type direct_fabs(type a) { return as_##type(as_##bits(a) & (bits)(~(sign))); }                               \
    DIRECT type direct_copysign(type a, type b) {                                                                       \
        return as_##type((as_##bits(a) & (bits)(~(sign))) | (as_##bits(b) & (bits)(sign)));                             \
    }

// Roots. The processor's are right to the last bit, as the library's.
#define DIRECT_ROOT(type, expression) DIRECT type direct_sqrt(type a) { return expression; }
#define DIRECT_ROOT_OF_HALVES(type) DIRECT_ROOT(type, (type)(direct_sqrt(a.lo), direct_sqrt(a.hi)))

#if __has_builtin(__builtin_elementwise_sqrt)
#define DIRECT_ROOTS_IN(number)                                                                                       \
    DIRECT_ROOT(number, __builtin_elementwise_sqrt(a)) DIRECT_ROOT(number##4, __builtin_elementwise_sqrt(a))          \
    DIRECT_ROOT(number##8, __builtin_elementwise_sqrt(a)) DIRECT_ROOT(number##16, __builtin_elementwise_sqrt(a))
#define DIRECT_ROOTS DIRECT_ROOTS_IN(float)
#define DIRECT_ROOTS_OF_DOUBLES DIRECT_ROOTS_IN(double)
#elif defined(__x86_64__) && __has_builtin(__builtin_ia32_sqrtps) && __has_builtin(__builtin_ia32_sqrtpd)
#define DIRECT_AS_SET 4  // rounding is what the processor is set to
#if defined(__AVX__) && __has_builtin(__builtin_ia32_sqrtps256)
#define DIRECT_ROOTS_8 DIRECT_ROOT(float8, __builtin_ia32_sqrtps256(a))
#define DIRECT_ROOTS_OF_4_DOUBLES DIRECT_ROOT(double4, __builtin_ia32_sqrtpd256(a))
#else
#define DIRECT_ROOTS_8 DIRECT_ROOT_OF_HALVES(float8)
#define DIRECT_ROOTS_OF_4_DOUBLES                              \
    DIRECT_ROOT(double2, __builtin_ia32_sqrtpd(a))             \
    DIRECT_ROOT_OF_HALVES(double4)
#endif
#if defined(__AVX512F__) && __has_builtin(__builtin_ia32_sqrtps512)
#define DIRECT_ROOTS_16 DIRECT_ROOT(float16, __builtin_ia32_sqrtps512(a, DIRECT_AS_SET))
#define DIRECT_ROOTS_OF_8_DOUBLES DIRECT_ROOT(double8, __builtin_ia32_sqrtpd512(a, DIRECT_AS_SET))
#else
#define DIRECT_ROOTS_16 DIRECT_ROOT_OF_HALVES(float16)
#define DIRECT_ROOTS_OF_8_DOUBLES DIRECT_ROOT_OF_HALVES(double8)
#endif
#define DIRECT_ROOTS                                       \
    DIRECT_ROOT(float, __builtin_sqrtf(a))                 \
    DIRECT_ROOT(float4, __builtin_ia32_sqrtps(a))          \
    DIRECT_ROOTS_8                                         \
    DIRECT_ROOTS_16
#define DIRECT_ROOTS_OF_DOUBLES                            \
    DIRECT_ROOT(double, __builtin_sqrt(a))                 \
    DIRECT_ROOTS_OF_4_DOUBLES                              \
    DIRECT_ROOTS_OF_8_DOUBLES                              \
    DIRECT_ROOT_OF_HALVES(double16)
#endif

// For all widths.
#define DIRECT_MEMORIES(type) DIRECT_MEMORY(type, 4) DIRECT_MEMORY(type, 8) DIRECT_MEMORY(type, 16)
#define DIRECT_WHOLES(type) DIRECT_WHOLE(type) DIRECT_WHOLE(type##4) DIRECT_WHOLE(type##8) DIRECT_WHOLE(type##16)
#define DIRECT_REALS(type, bits, sign)                                                                                  \
    DIRECT_REAL(type, bits, sign) DIRECT_REAL(type##4, bits##4, sign)                                                   \
    DIRECT_REAL(type##8, bits##8, sign) DIRECT_REAL(type##16, bits##16, sign)
DIRECT_MEMORIES(float) DIRECT_MEMORIES(int) DIRECT_MEMORIES(uint) DIRECT_MEMORIES(uchar)
DIRECT_WHOLES(int) DIRECT_WHOLES(uint) DIRECT_WHOLE(ulong)
DIRECT_REALS(float, uint, 0x80000000u)
DIRECT uchar direct_uchar_sat(float a) { return (uchar)direct_clamp(a, 0.0f, 255.0f); }
#if __has_builtin(__builtin_rintf)
DIRECT uchar direct_uchar_sat_rte(float a) { return (uchar)__builtin_rintf(direct_clamp(a, 0.0f, 255.0f)); }
#undef convert_uchar_sat_rte
#define convert_uchar_sat_rte(a) direct_uchar_sat_rte(a)
#endif
#if REAL_IS_DOUBLE
DIRECT_MEMORIES(double)
DIRECT_WHOLES(long)
DIRECT_REALS(double, ulong, 0x8000000000000000ul)
#else
DIRECT_WHOLE(long)
#endif
#ifdef DIRECT_ROOTS
DIRECT_ROOTS
#if REAL_IS_DOUBLE
DIRECT_ROOTS_OF_DOUBLES
#endif
#undef sqrt
#define sqrt(a) direct_sqrt(a)
#endif

// The drivers' own names may be macros; PoCL's even are where they are the beginning of a name that JOIN makes.
#undef vload
#undef vstore
#undef vload4
#undef vload8
#undef vload16
#undef vstore4
#undef vstore8
#undef vstore16
#define vload4(offset, p) direct_load4((p) + 4 * (size_t)(offset))
#define vload8(offset, p) direct_load8((p) + 8 * (size_t)(offset))
#define vload16(offset, p) direct_load16((p) + 16 * (size_t)(offset))
#define vstore4(value, offset, p) direct_store4(value, (p) + 4 * (size_t)(offset))
#define vstore8(value, offset, p) direct_store8(value, (p) + 8 * (size_t)(offset))
#define vstore16(value, offset, p) direct_store16(value, (p) + 16 * (size_t)(offset))
#undef min
#undef max
#undef fmin
#undef fmax
#undef clamp
#undef mix
#undef fabs
#undef copysign
#define min(a, b) direct_min(a, b)
#define max(a, b) direct_max(a, b)
#define fmin(a, b) direct_fmin(a, b)
#define fmax(a, b) direct_fmax(a, b)
#define clamp(a, low, high) direct_clamp(a, low, high)
#define mix(a, b, share) direct_mix(a, b, share)
#define fabs(a) direct_fabs(a)
#define copysign(a, b) direct_copysign(a, b)
#if __has_builtin(__builtin_elementwise_floor)
#undef floor
#define floor(a) direct_floor(a)
#endif

// Bits of whole numbers of 32; there is no count of the zeros of 0.
#undef popcount
#undef clz
#define popcount(a) __builtin_popcount(a)
#define clz(a) __builtin_clz(a)

// Conversions, each as OpenCL rounds it: towards 0 to whole numbers, to the nearest real one.
#undef convert_uchar
#undef convert_uchar_sat
#define convert_uchar(a) ((uchar)(a))
#define convert_uchar_sat(a) direct_uchar_sat(a)
#if __has_builtin(__builtin_convertvector)
#define CONVERT(type, a) __builtin_convertvector(a, type)
#endif
#endif

// The conversion of a vector to one of another type.
#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)
#ifndef CONVERT
#define CONVERT(type, a) JOIN(convert_, type)(a)
#endif
