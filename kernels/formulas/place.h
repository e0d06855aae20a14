// Where orbits begin whose scene shows a place of a formula's space, magnified (`clfractal/formulas/deep.py`): of points near the place
// many applications on, where a table says so.
//
// The table stands among the constants. First the lowest binary exponent of |p|^2 that is told apart, the number of entries, how wide these
// are, one unit of the scene in the formula's space, where z of the place's own orbit stands, and the count of the first one; then C of the
// place, each number with how it changes with the point; then the entries. Each has the count, the scalar derivative, where the list of its
// events begins (0: it has none), and of each number of the state its value at the place and how it changes with the point. Which one is a
// point's, |p| alone decides.
//
// At an event the map is not straight over all that is seen: an application is done operation by operation, beside the place's own. A list
// has their number, and of each: where the formula's operations begin, what the place has of each operation, and then the straight way on,
// to the next event or to the count: a factor of the scalar derivative, a matrix by the state and one by the point, and the place's state.
#include "device/gather.h"
#include "formulas/near.h"

#define PLACE_HEAD 6
#define PLACE_STEP 2  // binary logarithm of how many exponents share an entry
#define PLACE_STATE 3 // numbers of an entry before its state
#if REAL_IS_DOUBLE
#define PLACE_EXPONENT(square) ((mask)(as_whole(square) >> 52) - 1023)
#else
#define PLACE_EXPONENT(square) ((mask)(as_whole(square) >> 23) - 127)
#endif

// An orbit where it begins.
typedef struct {
    near z[PLACED_WIDTH];
    real growth, begun;
    vec moved;  // the point from the place, in the formula's space
} placed;

INLINE real placed_load(mask entry, int apart, int offset, __constant const scalar *k) {
#if LANES == 1
    return k[entry + offset];
#else
    if (!apart) return (real)(k[lanes_most(entry) + offset]);
    int where[LANES];
    scalar found[LANES];
    ints_store(entry, where);
    for (int lane = 0; lane < LANES; ++lane) found[lane] = k[where[lane] + offset];
    return lanes_load(found);
#endif
}

// A number with its slopes, some of which a list of four has.
INLINE near placed_number(__constant const scalar *four, vec moved) {
    const real dx = (real)(four[1]), dy = (real)(four[2]), dz = (real)(four[3]);
    const real d = dx * moved.x + dy * moved.y + dz * moved.z;
    return (near){(real)(four[0]) + d, d, dx, dy, dz};
}

// The straight way from one count to a later one, which ends where the numbers of the list do.
INLINE __constant const scalar *placed_straight(near *z, real *growth, vec moved, __constant const scalar *list) {
    near next[PLACED_WIDTH];
    *growth *= (real)(list[0]);
    ++list;
    for (int i = 0; i < PLACED_WIDTH; ++i, list += PLACED_WIDTH + 4) {
        next[i] = placed_number(list, moved);
        for (int j = 0; j < PLACED_WIDTH; ++j) {
            const real by = (real)(list[4 + j]);
            next[i].d += by * z[j].d;
            next[i].dx += by * z[j].dx;
            next[i].dy += by * z[j].dy;
            next[i].dz += by * z[j].dz;
        }
        next[i].v = (real)(list[0]) + next[i].d;
    }
    for (int i = 0; i < PLACED_WIDTH; ++i) z[i] = next[i];
    return list;
}

// Follows the events of a list.
CALLED void placed_follow(near *z, real *growth, vec moved, int table, __constant const scalar *list, __constant const scalar *k) {
    near kept[NEAR_SLOTS];
    const int events = (int)list[0];
    ++list;
    for (int event = 0; event < events; ++event) {
        __constant const scalar *program = k + table + (int)list[0];
        const int count = (int)program[0];
        for (int i = 0; i < PLACED_WIDTH; ++i) kept[i] = z[i];
        for (int i = 0; i < STATE_SIZE; ++i) kept[PLACED_WIDTH + i] = placed_number(k + table + PLACE_HEAD + 4 * i, moved);
        kept[PLACED_WIDTH + STATE_SIZE] = (near){*growth, R(0.0), R(0.0), R(0.0), R(0.0)};
        near_run(kept, program + PLACED_WIDTH + 2, count, list + 1);
        for (int i = 0; i < PLACED_WIDTH; ++i) z[i] = kept[(int)program[1 + i]];
        *growth = kept[(int)program[1 + PLACED_WIDTH]].v;
        list = placed_straight(z, growth, moved, list + 1 + count);
    }
}

// Where the orbit of a point begins. No lane's depends on another's.
INLINE placed placed_begin(vec point, int table, __constant const scalar *k) {
    const mask lowest = (mask)((int)k[table]), last = (mask)((int)k[table + 1] - 1);
    mask index = (PLACE_EXPONENT(vec_dot(point, point)) - lowest) >> PLACE_STEP;
    index = min(max(index, (mask)(0)), last);
    const mask entry = index * (mask)((int)k[table + 2]) + (mask)(table + PLACE_HEAD + 4 * STATE_SIZE);
    const int apart = LANES > 1 && any_lane(index != (mask)((INTEGER)lanes_most(index)));
    placed at;
    at.moved = vec_scale(point, (real)(k[table + 3]));
    at.begun = placed_load(entry, apart, 0, k);
    at.growth = placed_load(entry, apart, 1, k);
    for (int i = 0; i < PLACED_WIDTH; ++i) {
        const int first = PLACE_STATE + 4 * i;
        near z;
        z.dx = placed_load(entry, apart, first + 1, k);
        z.dy = placed_load(entry, apart, first + 2, k);
        z.dz = placed_load(entry, apart, first + 3, k);
        z.d = z.dx * at.moved.x + z.dy * at.moved.y + z.dz * at.moved.z;
        z.v = placed_load(entry, apart, first, k) + z.d;
        at.z[i] = z;
    }
    // Lanes with the same events follow them together.
    real events = placed_load(entry, apart, 2, k);
    while (any_lane(less(R(0.0), events))) {
#if LANES == 1
        const int which = (int)events;
#else
        const int which = (int)lanes_most(CONVERT(OF_LANES(INTEGER), events));
#endif
        const mask these = equal(events, (real)((scalar)which));
        near z[PLACED_WIDTH];
        real growth = at.growth;
        for (int i = 0; i < PLACED_WIDTH; ++i) z[i] = at.z[i];
        placed_follow(z, &growth, at.moved, table, k + table + which, k);
        at.growth = pick(these, growth, at.growth);
        for (int i = 0; i < PLACED_WIDTH; ++i) {
            at.z[i].v = pick(these, z[i].v, at.z[i].v);
            at.z[i].dx = pick(these, z[i].dx, at.z[i].dx);
            at.z[i].dy = pick(these, z[i].dy, at.z[i].dy);
            at.z[i].dz = pick(these, z[i].dz, at.z[i].dz);
        }
        events = pick(these, R(0.0), events);
    }
    return at;
}

// The first count at which an orbit of these lanes begins.
INLINE int placed_first(real begun, mask lanes) {
#if LANES == 1
    return (int)begun;
#else
    const mask counts = CONVERT(OF_LANES(INTEGER), begun);
    return (int)-lanes_most((lanes & -counts) | (~lanes & (mask)(-0x7fffff)));
#endif
}
