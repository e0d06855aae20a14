// Where orbits begin whose scene shows a place of a formula's space, magnified (`clfractal/formulas/deep.py`): of points near the place
// many applications on, where a table says so.
//
// The table stands among the constants: the lowest binary exponent of |p|^2 that is told apart, the number of entries, how wide these are,
// one unit of the scene in the formula's space, where z of the place's own orbit stands, and the count of the first one; then the entries.
// Each has the count, the scalar derivative, and of each number of the state its value at the place and how it changes with the point.
// Which one is a point's, |p| alone decides.
#include "device/gather.h"

#define PLACE_HEAD 6
#define PLACE_STEP 2  // binary logarithm of how many exponents share an entry
#if REAL_IS_DOUBLE
#define PLACE_EXPONENT(square) ((mask)(as_whole(square) >> 52) - 1023)
#else
#define PLACE_EXPONENT(square) ((mask)(as_whole(square) >> 23) - 127)
#endif

typedef struct {
    mask entry;   // where each lane's begins
    int apart;    // whether they differ
    vec moved;    // the point, from the place, in the formula's space
} placed;

INLINE placed placed_at(vec point, int table, __constant const scalar *k) {
    const mask lowest = (mask)((int)k[table]), last = (mask)((int)k[table + 1] - 1);
    mask index = (PLACE_EXPONENT(vec_dot(point, point)) - lowest) >> PLACE_STEP;
    index = min(max(index, (mask)(0)), last);
    placed at;
    at.entry = index * (mask)((int)k[table + 2]) + (mask)(table + PLACE_HEAD);
    at.apart = LANES > 1 && any_lane(index != (mask)((INTEGER)lanes_most(index)));
    at.moved = vec_scale(point, (real)(k[table + 3]));
    return at;
}

INLINE real placed_load(const placed *at, int offset, __constant const scalar *k) {
#if LANES == 1
    return k[at->entry + offset];
#else
    if (!at->apart) return (real)(k[lanes_most(at->entry) + offset]);
    int where[LANES];
    scalar found[LANES];
    ints_store(at->entry, where);
    for (int lane = 0; lane < LANES; ++lane) found[lane] = k[where[lane] + offset];
    return lanes_load(found);
#endif
}

INLINE real placed_count(const placed *at, __constant const scalar *k) { return placed_load(at, 0, k); }
INLINE real placed_growth(const placed *at, __constant const scalar *k) { return placed_load(at, 1, k); }

// A number of the state, with how it changes with the point.
INLINE dual placed_dual(const placed *at, int number, __constant const scalar *k) {
    const int first = 2 + 4 * number;
    const real dx = placed_load(at, first + 1, k), dy = placed_load(at, first + 2, k), dz = placed_load(at, first + 3, k);
    const real away = dx * at->moved.x + dy * at->moved.y + dz * at->moved.z;
    return (dual){placed_load(at, first, k) + away, dx, dy, dz};
}

INLINE real placed_real(const placed *at, int number, __constant const scalar *k) { return placed_dual(at, number, k).v; }

// The first count at which an orbit of these lanes begins.
INLINE int placed_first(real begun, mask lanes) {
#if LANES == 1
    return (int)begun;
#else
    const mask counts = CONVERT(OF_LANES(INTEGER), begun);
    return (int)-lanes_most((lanes & -counts) | (~lanes & (mask)(-0x7fffff)));
#endif
}
