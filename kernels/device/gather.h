// Loads from places that differ from lane to lane. Where the compiler generates x86 code directly, the instruction is named;
// elsewhere lanes are loaded one after another.
typedef mask ints;
#if LANES == 1
#define to_ints(a) ((int)(a))
#define ints_load(array) ((array)[0])
#define ints_store(value, array) ((array)[0] = (value))
#define floats_load(array) ((array)[0])
#define pick_ints(m, yes, no) ((m) ? (yes) : (no))
#else
#define to_ints(a) CONVERT(OF_LANES(INTEGER), a)
#if REAL_IS_DOUBLE
// As wide as masks; in memory these are ints and floats.
#define ints_load(array) to_ints(JOIN(vload, LANES)(0, array))
#define ints_store(value, array) JOIN(vstore, LANES)(CONVERT(OF_LANES(int), value), 0, array)
#define floats_load(array) to_reals(JOIN(vload, LANES)(0, array))
#else
// Without a conversion to the type that they have: Intel's compiler takes minutes for many of these.
#define ints_load(array) JOIN(vload, LANES)(0, array)
#define ints_store(value, array) JOIN(vstore, LANES)(value, 0, array)
#define floats_load(array) JOIN(vload, LANES)(0, array)
#endif
#define pick_ints(m, yes, no) ((m) ? (ints)(yes) : (ints)(no))
#endif

#if !REAL_IS_DOUBLE && defined(__has_builtin) && !defined(INTERPRETED)
#if LANES == 16 && defined(__AVX512F__) && __has_builtin(__builtin_ia32_gathersiv16si)
#define gather_at(base, index, scale) \
    __builtin_ia32_gathersiv16si((int16)(0), (const void *)(size_t)(base), index, (ushort)(0xffff), scale)
#elif LANES == 8 && defined(__AVX2__) && __has_builtin(__builtin_ia32_gatherd_d256)
#define gather_at(base, index, scale) \
    __builtin_ia32_gatherd_d256((int8)(0), (__private const int *)(size_t)(base), index, (int8)(-1), scale)
#endif
#endif

INLINE real between(real a, real b, real share) { return a + (b - a) * share; }

// 32 bits at base + index, in whole ints.
INLINE ints gather_ints(__global const int *base, ints index) {
#ifdef gather_at
    return gather_at(base, index, 4);
#else
    int where[LANES], found[LANES];
    ints_store(index, where);
    for (int lane = 0; lane < LANES; ++lane) found[lane] = base[where[lane]];
    return ints_load(found);
#endif
}

INLINE real gather_floats(__global const float *base, ints index) {
#ifdef gather_at
    return as_real(gather_at(base, index, 4));
#else
    int where[LANES];
    float found[LANES];
    ints_store(index, where);
    for (int lane = 0; lane < LANES; ++lane) found[lane] = base[where[lane]];
    return floats_load(found);
#endif
}

// The bytes at base + index and at the next place. (Up to two more are read.)
INLINE void gather_pair(__global const uchar *base, ints index, real *first, real *second) {
#ifdef gather_at
    const ints both = gather_at(base, index, 1);
    *first = to_reals(both & 255);
    *second = to_reals((both >> 8) & 255);
#else
    int where[LANES], one[LANES], two[LANES];
    ints_store(index, where);
    for (int lane = 0; lane < LANES; ++lane) {
        one[lane] = base[where[lane]];
        two[lane] = base[where[lane] + 1];
    }
    *first = to_reals(ints_load(one));
    *second = to_reals(ints_load(two));
#endif
}
