// Where chains go through a body of any shape between two ends: Newton's method on the direction in which a ray sets out, until what leaves the
// body meets the end. It begins at random places of the boundary; how likely it is that these lead to the chain that was taken is estimated as
// in `level_search.h`. What is reflected within the body is not among them.
#include "integrators/chain_list.h"
#include "integrators/shape_chains.h"

#define SHAPE_STEPS 14           // of Newton's method, with those that are taken back
#define SHAPE_NEAR R(1e-5)       // what the end may be missed by, radians
#define SHAPE_BEGINNINGS 8
#define SHAPE_APART R(0.01)      // nearer than which chains are one, by how large the body is seen

// How a ray goes through a body that sets out in a direction, and what it misses the end by.
typedef struct {
    vec toward;
    beam_miss missed;
    real there;               // whether it gets through, and the end is before it
} shape_way;
NUMBERS_PICKED(shape_way)

INLINE real shape_wrong(const shape_way *w) { return w->missed.side * w->missed.side + w->missed.up * w->missed.up; }

CALLED shape_way shape_way_of(object_record o, const facets *f, real index, const vec *from, const vec *toward, const chain_end *end) {
    shape_way w;
    chain_beam b;
    chain unused;
    const mask outside = less(R(1.0), R(0.0)), through = chain_through(o, f, index, from, toward, from, outside, &b, &unused);
    w.toward = *toward;
    w.missed = beam_misses(&b, end);
    w.there = number_of(through & less(R(0.0), w.missed.left));
    return w;
}

// From a direction on, which becomes a chain's way where the result says so. Steps that come no nearer are shortened; none is wider than the
// body is seen.
CALLED mask shape_searched(object_record o, const facets *f, real index, const vec *from, const vec *begin, const chain_end *end, real wide,
                           shape_way *w, mask wanted) {
    mask going = wanted;
    vec toward = *begin;
    real length = R(1.0), wrong = (real)(REAL_LARGEST);
    for (int step = 0; step <= SHAPE_STEPS; ++step) {
        const shape_way next = shape_way_of(o, f, index, from, &toward, end);
        const real misses = shape_wrong(&next);
        const mask nearer = going & mask_of(next.there) & less(misses, wrong);
        if (step == 0) {
            *w = next;
            going = nearer;
        } else {
            *w = shape_way_pick(nearer, next, *w);
            length = pick(nearer, fmin(R(2.0) * length, R(1.0)), R(0.35) * length);
        }
        wrong = pick(nearer, misses, wrong);
        going &= less(SHAPE_NEAR * SHAPE_NEAR, wrong) & less(R(0.02), length);
        if (!any_lane(going)) break;
        const beam_miss *m = &w->missed;
        const real turns = miss_turns(m), share = R(1.0) / pick(less(fabs(turns), R(1e-12)), R(1e-12), turns);
        const real x = (m->side * m->up_by[1] - m->up * m->side_by[1]) * share, y = (m->up * m->side_by[0] - m->side * m->up_by[0]) * share;
        const real far = fmin(length, wide / fmax(sqrt(x * x + y * y), (real)(REAL_SMALLEST)));
        vec side, up;
        make_frame(w->toward, &side, &up);
        const vec turned = vec_along(vec_along(w->toward, far * x, side), far * y, up);
        toward = vec_normalize(vec_pick(going, turned, *begin));
    }
    return wanted & mask_of(w->there) & less(wrong, R(25.0) * SHAPE_NEAR * SHAPE_NEAR);
}

// Towards a random place of the boundary, of which each number is another one, as in `level_found`.
INLINE vec shape_begins(object_record o, vec from, bits seed, int number) {
    bits stream = hash_bits(seed + (bits)((uint)number * 0x85ebca6bu));
    vec own;
    own.x = R(2.0) * next_random(&stream) - R(1.0);
    own.y = R(2.0) * next_random(&stream) - R(1.0);
    own.z = R(2.0) * next_random(&stream) - R(1.0);
    own = vec_mul(shape_on(o->kind, vec_splat(o->form), own), vec_splat(o->sides));
    const vec place = vec_add(vec_splat(o->middle), vec_of_axes(o, vec_mul(own, vec_splat(o->sides))));
    return vec_normalize(vec_sub(place, from));
}

// In which direction a chain sets out that goes through a body from outside, one of those that several beginnings lead to, and 1 over the
// probability of having found it, as of `level_chain`.
CALLED mask shape_chain(object_record o, const facets *f, real index, const vec *from, const chain_end *end, real least, bits seed, mask wanted,
                        vec *toward, real *chances) {
    const vec offset = vec_sub(vec_splat(o->middle), *from);
    const scalar reach = fmax(fmax(o->sides[0], o->sides[1]), o->sides[2]);
    const real distance = sqrt(vec_dot(offset, offset)), wide = fmin((real)(reach) / fmax(distance, (real)(REAL_SMALLEST)), R(1.0));
    *chances = R(1.0);
    *toward = vec_of(R(0.0), R(0.0), R(1.0));
    wanted &= ~object_holds(o, *from) & ~(object_holds(o, end->at) & ~end->far);
    if (!any_lane(wanted)) return wanted;
    // What tells chains apart: their directions along two axes, across that to the middle.
    const vec axis = vec_scale(offset, R(1.0) / fmax(distance, (real)(REAL_SMALLEST)));
    vec side, up;
    make_frame(axis, &side, &up);
    const real apart = SHAPE_APART * wide;
    chain_list all;
    for (int i = SHAPE_BEGINNINGS; i < CHAIN_BEGINNINGS; ++i) all.times[i] = R(0.0);
    listed_chain one = {R(0.0), R(0.0), R(1.0), R(0.0), R(1.0)};
    mask open = wanted;
    real found = R(0.0);
    // (Beginnings and trials are one loop: compilers write what it does once.)
    for (int i = 0; i < SHAPE_BEGINNINGS + CHAIN_TRIALS; ++i) {
        if (i == SHAPE_BEGINNINGS) {
            one = list_chooses(&all, next_random(&seed), R(1.0), least);
            open = wanted & equal(one.times, R(1.0));
        }
        if (!any_lane(open)) break;
        shape_way w;
        const vec begin = shape_begins(o, *from, seed, i);
        const mask fresh = shape_searched(o, f, index, from, &begin, end, wide, &w, open);
        const real u = vec_dot(w.toward, side), v = vec_dot(w.toward, up), turns = miss_turns(&w.missed);
        if (i < SHAPE_BEGINNINGS) {
            list_takes(&all, i, u, v, turns, apart, fresh);
        } else {
            open &= ~(fresh & same_chain(u, v, turns, one.u, one.v, one.turns, apart));
            found += number_of(open);
        }
    }
    const mask there = wanted & less(R(0.0), one.times);
    *chances = (R(1.0) + found / (real)((scalar)SHAPE_BEGINNINGS)) * one.chances;
    const real along = sqrt(fmax(R(1.0) - one.u * one.u - one.v * one.v, R(0.0)));
    *toward = vec_pick(there, vec_along(vec_along(vec_scale(axis, along), one.u, side), one.v, up), *toward);
    return there;
}
