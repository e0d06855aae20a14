// Structs of reals in the device's memory. Of each number stand the lanes of all packets in a row, and number after number
// `stride` apart, so that neighbouring work-items read neighbouring memory. Masks are kept as 1 or 0.
#define NUMBERS_OF(type) ((int)(sizeof(type) / sizeof(real)))
#define KEEP(thing, to, stride) KEEP_NUMBERS((const real *)&(thing), NUMBERS_OF(thing), to, stride)
#define RECALL(thing, from, stride) RECALL_NUMBERS((real *)&(thing), NUMBERS_OF(thing), from, stride)

// Does something for each number below a count of at most MOST_NUMBERS. Where it is written out compilers hold the struct in
// registers; a loop takes them less time.
#define MOST_NUMBERS 20
#define WRITTEN_OUT(count, DO)                                                                                              \
    IF_BELOW(0, count, DO) IF_BELOW(1, count, DO) IF_BELOW(2, count, DO) IF_BELOW(3, count, DO) IF_BELOW(4, count, DO)      \
    IF_BELOW(5, count, DO) IF_BELOW(6, count, DO) IF_BELOW(7, count, DO) IF_BELOW(8, count, DO) IF_BELOW(9, count, DO)      \
    IF_BELOW(10, count, DO) IF_BELOW(11, count, DO) IF_BELOW(12, count, DO) IF_BELOW(13, count, DO) IF_BELOW(14, count, DO) \
    IF_BELOW(15, count, DO) IF_BELOW(16, count, DO) IF_BELOW(17, count, DO) IF_BELOW(18, count, DO) IF_BELOW(19, count, DO)
#define IF_BELOW(i, count, DO) if (i < (count)) { DO(i) }
#if LANES == 1
#define FOR_NUMBERS(count, DO) WRITTEN_OUT(count, DO)
#else
#define FOR_NUMBERS(count, DO) _Pragma("unroll 1") for (int i = 0; i < (count); ++i) { DO(i) }
#endif

// Of constant counts: compilers then never see what is beyond them, which of functions' arguments they find out late.
#define KEEP_NUMBERS(thing, count, to, stride)                                          \
    do {                                                                                \
        const real *kept_ = (thing);                                                    \
        __global scalar *to_ = (to);                                                    \
        const int stride_ = (stride);                                                   \
        WRITTEN_OUT(count, KEEP_NUMBER)                                                 \
    } while (0)
#define KEEP_NUMBER(i) lanes_store(kept_[i], to_ + i * stride_);
#define RECALL_NUMBERS(thing, count, from, stride)                                      \
    do {                                                                                \
        real *recalled_ = (thing);                                                      \
        __global const scalar *from_ = (from);                                          \
        const int stride_ = (stride);                                                   \
        WRITTEN_OUT(count, RECALL_NUMBER)                                               \
    } while (0)
#define RECALL_NUMBER(i) recalled_[i] = lanes_load(from_ + i * stride_);

// The same of lanes that may stand apart: then each has its own place, counted from where `to` or `from` is. Two at one place hold the same.
typedef struct {
    int apart;            // 0: they stand in a row
    OF_LANES(int) each;
} lane_places;
#if LANES == 1
#define STAND_APART(at) 0
#define EACH_LANE(DO)
#else
#define STAND_APART(at) (at).apart
#endif
#if LANES == 4
#define EACH_LANE(DO) DO(0) DO(1) DO(2) DO(3)
#elif LANES == 8
#define EACH_LANE(DO) DO(0) DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7)
#elif LANES == 16
#define EACH_LANE(DO) DO(0) DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7) DO(8) DO(9) DO(a) DO(b) DO(c) DO(d) DO(e) DO(f)
#endif
INLINE real lanes_load_at(__global const scalar *from, const lane_places *at) {
    if (!STAND_APART(*at)) return lanes_load(from);
    real found = R(0.0);
#define GATHER_LANE(i) found.s##i = from[at->each.s##i];
    EACH_LANE(GATHER_LANE)
    return found;
}
INLINE void lanes_store_at(real value, __global scalar *to, const lane_places *at) {
    if (!STAND_APART(*at)) {
        lanes_store(value, to);
        return;
    }
#define SCATTER_LANE(i) to[at->each.s##i] = value.s##i;
    EACH_LANE(SCATTER_LANE)
}
#define KEEP_NUMBERS_AT(thing, count, to, stride, at)                                   \
    do {                                                                                \
        if (STAND_APART(at)) {                                                          \
            const real *kept_ = (thing);                                                \
            __global scalar *to_ = (to);                                                \
            const int stride_ = (stride);                                               \
            const lane_places at_ = (at);                                               \
            WRITTEN_OUT(count, KEEP_NUMBER_AT)                                          \
        } else KEEP_NUMBERS(thing, count, to, stride);                                  \
    } while (0)
#define RECALL_NUMBERS_AT(thing, count, from, stride, at)                               \
    do {                                                                                \
        if (STAND_APART(at)) {                                                          \
            real *recalled_ = (thing);                                                  \
            __global const scalar *from_ = (from);                                      \
            const int stride_ = (stride);                                               \
            const lane_places at_ = (at);                                               \
            WRITTEN_OUT(count, RECALL_NUMBER_AT)                                        \
        } else RECALL_NUMBERS(thing, count, from, stride);                              \
    } while (0)
#define KEEP_NUMBER_AT(i) lanes_store_at(kept_[i], to_ + i * stride_, &at_);
#define RECALL_NUMBER_AT(i) recalled_[i] = lanes_load_at(from_ + i * stride_, &at_);

// Of lanes `here` one struct of numbers, of the others another: TYPE_pick.
#define NUMBERS_PICKED(type)                                                                                                 \
    INLINE type type##_pick(mask here, type yes, type no) {                                                                 \
        for (int i = 0; i < NUMBERS_OF(type); ++i) ((real *)&no)[i] = pick(here, ((const real *)&yes)[i], ((real *)&no)[i]); \
        return no;                                                                                                          \
    }

INLINE real number_of(mask m) { return pick(m, R(1.0), R(0.0)); }
INLINE mask mask_of(real number) { return less(R(0.5), number); }
