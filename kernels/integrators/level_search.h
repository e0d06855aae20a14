// Where chains cross a level between two ends: where the way of the light is stationary (Fermat). Newton's method on the place goes there from
// random beginnings. How likely it is that these lead to the chain that was found is estimated by trying others until one does (Zeltner,
// Georgiev, Jakob 2020, Specular Manifold Sampling), so that the mean is right however many chains there are.
#include "integrators/chain_list.h"

#define LEVEL_TURNS 16     // of Newton's method, with those that are taken back
#define LEVEL_NEAR R(4e-6) // the change of the way where it is stationary, by the index of the open
#define LEVEL_WIDE R(1.5)  // how far from the flat level's chain they are, by what waves of the mean slope do

// A level between two ends, in its own frame: from over or under the place (x, y) of it, where places begin.
typedef struct {
    real x, y, height;
    vec end;
    mask far;
    real before, beyond;   // indices of refraction
} level_ends;

// How the way of the light over a place of the level changes there.
typedef struct {
    real x, y;                  // its slopes ...
    real bend_x, bend_y;        // ... and how these change
    real both, other;           // the slope along x on a way along y, and the other one
    real presses;               // what a slope of the level adds to them
    real height;
    real crosses;               // whether it crosses the level there
} level_way;
NUMBERS_PICKED(level_way)

INLINE real level_wrong(const level_way *w) { return w->x * w->x + w->y * w->y; }
INLINE real level_turns(const level_way *w) { return w->bend_x * w->bend_y - w->both * w->other; }

// The level's slopes as its facets have them, and how these change.
typedef struct {
    real x, y, bend_x, bend_y, both, other;
} level_slopes;

INLINE level_slopes level_tilted(const facets *f, const water_shape *s) {
    level_slopes t = {s->slope_x, s->slope_y, s->bend_x, s->bend_y, s->bend_both, s->bend_both};
    if (f->wide <= S(0.0)) return t;
    const real share = R(1.0) / sqrt(R(1.0) + s->slope_x * s->slope_x + s->slope_y * s->slope_y);
    const vec normal = vec_scale(vec_of(-s->slope_x, -s->slope_y, R(1.0)), share);
    const tilted facet = tilted_on(f, 0, normal);
    const real over = facet.normal.z, each = R(-1.0) / pick(less(fabs(over), R(1e-3)), R(1e-3), over);
    t.x = facet.normal.x * each;
    t.y = facet.normal.y * each;
    for (int i = 0; i < 2; ++i) {
        const vec bends = vec_scale(i ? vec_of(-s->bend_both, -s->bend_y, R(0.0)) : vec_of(-s->bend_x, -s->bend_both, R(0.0)), share);
        const vec turned = tilted_turns(f, 0, &facet, normal, vec_along(bends, -vec_dot(bends, normal), normal));
        const real x = (turned.x + t.x * turned.z) * each, y = (turned.y + t.y * turned.z) * each;
        if (i) {
            t.both = x;
            t.bend_y = y;
        } else {
            t.bend_x = x;
            t.other = y;
        }
    }
    return t;
}

// `flat`: of the level without its waves. (A facet's slopes count for the way of the light, the level's own for where it goes.)
CALLED level_way level_way_at(object_record o, const level_ends *e, const facets *f, real u, real v, int flat) {
    water_shape s = {R(0.0), R(0.0), R(0.0), R(0.0), R(0.0), R(0.0)};
    if (!flat) s = water_shape_at(o, e->x + u, e->y + v);
    const vec place = vec_of(u, v, s.height), in = vec_of(u, v, s.height - e->height);
    const real first = R(1.0) / fmax(sqrt(vec_dot(in, in)), (real)(REAL_SMALLEST));
    const vec a = vec_scale(in, first), rest = vec_pick(e->far, e->end, vec_sub(e->end, place));
    const real last = R(1.0) / fmax(sqrt(vec_dot(rest, rest)), (real)(REAL_SMALLEST));
    const vec b = vec_scale(rest, last);
    const real near = e->before * first, on = pick(e->far, R(0.0), e->beyond * last);
    const real a_x = a.x + a.z * s.slope_x, a_y = a.y + a.z * s.slope_y, b_x = b.x + b.z * s.slope_x, b_y = b.y + b.z * s.slope_y;
    const level_slopes t = level_tilted(f, &s);
    const real in_x = a.x + a.z * t.x, in_y = a.y + a.z * t.y, out_x = b.x + b.z * t.x, out_y = b.y + b.z * t.y;
    level_way w;
    w.presses = e->before * a.z - e->beyond * b.z;
    w.x = e->before * in_x - e->beyond * out_x;
    w.y = e->before * in_y - e->beyond * out_y;
    w.bend_x = (near + on) * (R(1.0) + t.x * s.slope_x) - near * in_x * a_x - on * out_x * b_x + w.presses * t.bend_x;
    w.bend_y = (near + on) * (R(1.0) + t.y * s.slope_y) - near * in_y * a_y - on * out_y * b_y + w.presses * t.bend_y;
    w.both = (near + on) * t.x * s.slope_y - near * in_x * a_y - on * out_x * b_y + w.presses * t.both;
    w.other = (near + on) * s.slope_x * t.y - near * a_x * in_y - on * b_x * out_y + w.presses * t.other;
    w.height = s.height;
    const real up = a.z - a.x * s.slope_x - a.y * s.slope_y, on_up = b.z - b.x * s.slope_x - b.y * s.slope_y;
    w.crosses = number_of(less(R(0.0), up * on_up));
    return w;
}

// Newton's method from a place, which becomes that of a chain; the result says where it is one. Steps that come no nearer are shortened.
CALLED mask level_searched(object_record o, const level_ends *e, const facets *f, real *u, real *v, level_way *found, int flat, mask wanted) {
    level_way w = level_way_at(o, e, f, *u, *v, flat);
    mask going = wanted;
    real length = R(1.0);
    for (int turn = 0; turn < LEVEL_TURNS; ++turn) {
        const real wrong = level_wrong(&w), turns = level_turns(&w);
        going &= less(LEVEL_NEAR * LEVEL_NEAR, wrong) & less(R(0.01), length);
        if (!any_lane(going)) break;
        const real share = -length / pick(less(fabs(turns), R(1e-12)), R(1e-12), turns);
        const real x = *u + (w.x * w.bend_y - w.y * w.both) * share, y = *v + (w.y * w.bend_x - w.x * w.other) * share;
        const level_way next = level_way_at(o, e, f, x, y, flat);
        const mask nearer = going & less(level_wrong(&next), wrong);
        *u = pick(nearer, x, *u);
        *v = pick(nearer, y, *v);
        w = level_way_pick(nearer, next, w);
        length = pick(nearer, fmin(R(2.0) * length, R(1.0)), R(0.35) * length);
    }
    *found = w;
    return wanted & mask_of(w.crosses) & less(level_wrong(&w), R(25.0) * LEVEL_NEAR * LEVEL_NEAR);
}

// How far from the flat level's chain others are to be expected, by the mean slope of the waves, and how many beginnings find about all: few
// where the waves bend the level less than the ends do.
typedef struct {
    real wide, count, apart;   // nearer than which those that bend alike are one
} level_spread;

INLINE level_spread level_spread_of(object_record o, const level_way *flat) {
    scalar steep = S(0.0), bent = S(0.0);
    for (int i = 0; i < WAVES; ++i) {
        const scalar square = o->wave_x[i] * o->wave_x[i] + o->wave_y[i] * o->wave_y[i];
        const scalar slope = S(0.5) * square * o->wave_height[i] * o->wave_height[i];
        steep += slope;
        bent += slope * square;
    }
    // A slope moves the chain by as much as it presses, over how the way bends.
    const real stiff = fmax(R(0.5) * (flat->bend_x + flat->bend_y), R(1e-6)), moves = fabs(flat->presses) / stiff, folds = moves * (real)(sqrt(bent));
    const real count = pick(less(folds, R(0.15)), R(2.0), pick(less(folds, R(0.4)), R(5.0), (real)((scalar)CHAIN_BEGINNINGS)));
    return (level_spread){LEVEL_WIDE * moves * (real)(sqrt(steep)), count, fmin(R(0.02) / stiff, (real)(S(0.3) * sqrt(steep / bent)))};
}

// A chain from a random beginning around the flat level's, of which each number is another one: lanes do not draw from a common stream, or they
// would depend on each other.
INLINE mask level_found(object_record o, const level_ends *e, const facets *f, real u, real v, real wide, bits seed, int number, real *x, real *y,
                        level_way *w, mask here) {
    bits stream = hash_bits(seed + (bits)((uint)number * 0x85ebca6bu));
    real sine, cosine;
    const real share = next_random(&stream), reach = wide * sqrt(share / (R(1.0) - share));
    wave_turn(R(6.283185307179586) * next_random(&stream), &sine, &cosine);
    *x = u + reach * cosine;
    *y = v + reach * sine;
    return level_searched(o, e, f, x, y, w, 0, here);
}

// Where a chain crosses a level, one of those that several beginnings lead to, each with about the probability of what it brings; and 1 over the
// probability of having found it. One that `count` beginnings lead to once only may as well have been missed: as many more as do not lead
// there until one does, over `count`, make up for all that were (the mean of 1 over a probability by geometric trials, of which the beginnings
// that all have in common are averaged). `light`: the direction in which the end is about; `least`: the determinant below which chains bring no more.
CALLED mask level_chain(object_record o, const facets *tilts, real index, const vec *from, const vec *light, mask within, const chain_end *end,
                        real least, bits seed, mask wanted, vec *place, real *chances) {
    facets f = *tilts;
    f.axis = vec_of(R(1.0), R(0.0), R(0.0));
    const vec middle = vec_splat(o->middle);
    level_ends e;
    const vec begin = object_own(o, vec_sub(*from, middle));
    e.x = begin.x;
    e.y = begin.y;
    e.height = begin.z;
    e.end = object_own(o, vec_pick(end->far, end->at, vec_sub(end->at, middle)));
    e.far = end->far;
    e.before = pick(within, index, R(1.0));
    e.beyond = pick(within, R(1.0), index);
    *chances = R(1.0);
    // The light has to be on the other side, but for what waves are high.
    const real more = pick(e.far, R(0.0), (real)(o->wave_reach));
    wanted &= (within & less(-more, e.end.z)) | (~within & less(e.end.z, more));
    if (!any_lane(wanted)) return wanted;
    e.end = vec_pick(e.far, e.end, vec_of(e.end.x - e.x, e.end.y - e.y, e.end.z));
    // The flat level's chain, from where that of a light far away is, or from where a straight way to a place crosses the level. (The way of the
    // light has one least place, and Newton's method goes there from all that are not far beyond both ends.)
    const vec straight = object_own(o, *light);
    const real ratio = e.beyond / e.before, level = fmin(ratio * ratio * (R(1.0) - straight.z * straight.z), R(0.999));
    const real below = fabs(e.height), slope = ratio / sqrt(fmax(R(1.0) - level, R(1e-3))) * below;
    const real part = below / fmax(below + fabs(e.end.z), (real)(REAL_SMALLEST));
    real u = pick(e.far, slope * straight.x, part * e.end.x), v = pick(e.far, slope * straight.y, part * e.end.y), height = R(0.0);
    level_way w;
    mask there = level_searched(o, &e, &f, &u, &v, &w, 1, wanted);
    if (o->kind == OBJECT_WATER && o->wave_reach > S(0.0)) {
        const level_spread spread = level_spread_of(o, &w);
        // About the chain's determinant is that of how its way bends, by the index beyond and how far it is from the event.
        const real scale = (u * u + v * v + e.height * e.height) / (e.beyond * e.beyond);
        chain_list all;
        real found = R(0.0), x, y;
        for (int i = 0; i < CHAIN_BEGINNINGS; ++i) {
            const mask here = wanted & less((real)((scalar)i), spread.count);
            all.times[i] = R(0.0);
            if (!any_lane(here)) continue;
            const mask fresh = level_found(o, &e, &f, u, v, spread.wide, seed, i, &x, &y, &w, here);
            list_takes(&all, i, x, y, level_turns(&w), spread.apart, fresh);
        }
        const listed_chain one = list_chooses(&all, next_random(&seed), scale, least);
        there = wanted & less(R(0.0), one.times);
        mask open = there & equal(one.times, R(1.0));
        for (int trial = 0; trial < CHAIN_TRIALS; ++trial) {
            if (!any_lane(open)) break;
            open &= ~(level_found(o, &e, &f, u, v, spread.wide, seed, CHAIN_BEGINNINGS + trial, &x, &y, &w, open)
                      & same_chain(x, y, level_turns(&w), one.u, one.v, one.turns, spread.apart));
            found += number_of(open);
        }
        *chances = (R(1.0) + found / spread.count) * one.chances;
        u = pick(there, one.u, u);
        v = pick(there, one.v, v);
        height = water_shape_at(o, e.x + u, e.y + v).height;
    }
    *place = vec_add(middle, vec_of_axes(o, vec_of(e.x + u, e.y + v, height)));
    return there;
}
