// Structs of reals in the device's memory. Of each number stand the lanes of all packets in a row, and number after number
// `stride` apart, so that neighbouring work-items read neighbouring memory. Masks are kept as 1 or 0.
#define NUMBERS_OF(type) ((int)(sizeof(type) / sizeof(real)))
#define KEEP(thing, to, stride) numbers_keep((const real *)&(thing), NUMBERS_OF(thing), to, stride)
#define RECALL(thing, from, stride) numbers_recall((real *)&(thing), NUMBERS_OF(thing), from, stride)

// Written out: a loop over a struct's numbers would keep compilers for GPUs from holding the struct in registers.
#define MOST_NUMBERS 20
#define EACH_NUMBER(DO) DO(0) DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7) DO(8) DO(9) DO(10) DO(11) DO(12) DO(13) DO(14) DO(15) \
    DO(16) DO(17) DO(18) DO(19)

INLINE void numbers_keep(const real *numbers, int count, __global scalar *to, int stride) {
#define KEEP_NUMBER(i) if (i < count) lanes_store(numbers[i], to + i * stride);
    EACH_NUMBER(KEEP_NUMBER)
}

INLINE void numbers_recall(real *numbers, int count, __global const scalar *from, int stride) {
#define RECALL_NUMBER(i) if (i < count) numbers[i] = lanes_load(from + i * stride);
    EACH_NUMBER(RECALL_NUMBER)
}

INLINE real number_of(mask m) { return pick(m, R(1.0), R(0.0)); }
INLINE mask mask_of(real number) { return less(R(0.5), number); }
