// What is found out about points of a plane, whichever formula they are of.

// Whether two numbers have the same bits: unlike `equal`, this distinguishes +0 and -0.
#if REAL_IS_DOUBLE
#if LANES == 1
#define same_bits(a, b) (-(as_long(a) == as_long(b)))
#else
#define same_bits(a, b) (JOIN(as_long, LANES)(a) == JOIN(as_long, LANES)(b))
#endif
#elif LANES == 1
#define same_bits(a, b) (-(as_int(a) == as_int(b)))
#else
#define same_bits(a, b) (as_mask(a) == as_mask(b))
#endif

typedef struct {
    real count;         // applications until |z| > bailout, whole or smooth; the limit for points that never get there
    mask inside;
    real applications;  // that it took to know
} escaped;
