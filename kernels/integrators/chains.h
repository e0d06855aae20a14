// Chains: ways of light that the boundaries of a clear body bend, smooth or slightly rough ones, from an event to a place of a light or in a
// light's direction.
//
// A chain is told by the direction in which it leaves the event. It is followed over the boundaries with what changes where that direction
// does (ray differentials, Igehy 1999). The determinant of what its end does is the generalized geometric term (Jakob and Marschner 2012). A
// level (a plane, or water with waves) is crossed once, a ball or a body of another shape twice. Chains between two ends are found by
// `ball_search.h`, `level_search.h` and `shape_search.h`.

#include "integrators/chain_facets.h"

#define CHAIN_TURNS R(1e-8)   // the least determinant: nearer to the edge of a caustic there is no chain

// The other end: a place, or a direction of length 1; and how far the place is from where angles at it are told by.
typedef struct {
    vec at;
    mask far;
    real distance;
} chain_end;

typedef struct {
    real fails;
    vec enters, leaves;     // where it crosses the first boundary, and the last one ...
    vec before, beyond;     // ... and their normals, away from the body
    vec arrives;            // in which direction it goes on there
    real passes;            // part of the light that goes through
    real chance;            // with which a path goes through, over that with which its facets are drawn here
    real turns;             // the determinant: by angles across that direction, radians
} chain;
NUMBERS_PICKED(chain)

// A boundary where a ray crosses it: the normal, away from the body, and of water how the height bends over its plane, and 1 over how long
// the normal was there.
typedef struct {
    vec normal;
    real along, across, both, share;
    vec own;               // of a shape: the place, in its own units
} chain_site;

// Bodies of other shapes than balls, as stages include them before what searches chains: `shape_chains.h`, or `plain_bodies.h`. Whether a
// body is one of them; how far it is along a ray to where that enters it, or from a place of the boundary to where it leaves it, or below 0; and
// its boundary.
INLINE int is_shot(object_record o);
CALLED real shape_crossed(object_record o, const vec *from, const vec *way, int leaves);
INLINE chain_site shape_site_at(object_record o, vec place);
INLINE vec shape_site_turns(object_record o, const chain_site *s, vec way);

INLINE int crosses_twice(object_record o) { return o->bends > 1; }
INLINE int is_ball(object_record o) { return crosses_twice(o) && !is_shot(o); }

INLINE chain_site chain_site_at(object_record o, vec place) {
    if (is_shot(o)) return shape_site_at(o, place);
    const vec offset = vec_sub(place, vec_splat(o->middle)), none = vec_of(R(0.0), R(0.0), R(0.0));
    chain_site s = {vec_splat(o->own_z), R(0.0), R(0.0), R(0.0), R(1.0), none};
    if (is_ball(o)) {
        s.normal = vec_normalize(offset);
    } else if (o->kind == OBJECT_WATER) {
        const vec own = object_own(o, offset);
        const water_shape w = water_shape_at(o, own.x, own.y);
        s.share = R(1.0) / sqrt(R(1.0) + w.slope_x * w.slope_x + w.slope_y * w.slope_y);
        s.normal = vec_scale(vec_of_axes(o, vec_of(-w.slope_x, -w.slope_y, R(1.0))), s.share);
        s.along = w.bend_x;
        s.across = w.bend_y;
        s.both = w.bend_both;
    }
    return s;
}

// How the normal changes on a way along the boundary.
INLINE vec chain_site_turns(object_record o, const chain_site *s, vec way) {
    if (is_shot(o)) return shape_site_turns(o, s, way);
    if (is_ball(o)) return vec_scale(way, (real)(S(1.0) / o->sides[0]));
    if (o->kind != OBJECT_WATER) return vec_of(R(0.0), R(0.0), R(0.0));
    const real x = vec_dot(way, own_axis(o, x)), y = vec_dot(way, own_axis(o, y));
    const real slope_x = s->along * x + s->both * y, slope_y = s->both * x + s->across * y;
    const vec turned = vec_scale(vec_of_axes(o, vec_of(-slope_x, -slope_y, R(0.0))), s->share);
    return vec_along(turned, -vec_dot(turned, s->normal), s->normal);
}

// A ray, and how where it begins and its direction change along two axes.
typedef struct {
    vec at, way;
    vec moves[2], turns[2];
} chain_beam;

// Takes it on to a boundary at a distance, and over it: `index` is that of the matter it comes from over that beyond. The result says
// whether it gets there, and through.
INLINE mask beam_crosses(object_record o, const facets *f, int number, chain_beam *b, real distance, vec place, real index, chain_site *site,
                         chain *found) {
    *site = chain_site_at(o, place);
    const real over = vec_dot(b->way, site->normal), side = pick(less(over, R(0.0)), R(1.0), R(-1.0)), level = fabs(over);
    const vec n = vec_scale(site->normal, side);   // against the ray
    vec m = n;
    real cosine = level;
    tilted tilt;
    if (f->wide > S(0.0)) {
        tilt = tilted_on(f, number, site->normal);
        m = vec_scale(tilt.normal, side);
        cosine = -vec_dot(b->way, m);
    }
    const real square = R(1.0) - index * index * (R(1.0) - cosine * cosine);
    mask there = less(R(0.0), distance) & less(distance, R(1e15)) & less(R(1e-3), level) & less(R(1e-3), cosine) & less(R(1e-4), square);
    const real far = pick(there, distance, R(0.0)), each = R(1.0) / fmax(level, R(1e-3));
    const real beyond = sqrt(fmax(square, R(1e-4))), bend = index * cosine - beyond;
    const real slope = index - index * index * cosine / beyond;
    for (int i = 0; i < 2; ++i) {
        const vec reached = vec_along(b->moves[i], far, b->turns[i]);
        const vec moved = vec_along(reached, vec_dot(reached, n) * each, b->way);
        vec turned = chain_site_turns(o, site, moved);
        if (f->wide > S(0.0)) turned = tilted_turns(f, number, &tilt, site->normal, turned);
        turned = vec_scale(turned, side);
        const real flatter = -(vec_dot(b->turns[i], m) + vec_dot(b->way, turned));
        b->moves[i] = moved;
        b->turns[i] = vec_along(vec_along(vec_scale(b->turns[i], index), bend, turned), slope * flatter, m);
    }
    b->at = place;
    b->way = vec_normalize(vec_along(vec_scale(b->way, index), bend, m));
    real passes = R(1.0) - fresnel_across(clamp(cosine, R(0.0), R(1.0)), R(1.0) / index);
    if (f->wide > S(0.0)) {
        const real onward = -vec_dot(b->way, n);
        there &= less(R(1e-3), onward);
        // Paths draw what they see of facets, chains all of them.
        passes *= fmax(cosine, R(1e-3)) * each / (vec_dot(m, n) * facets_hide(f, fmax(level, R(1e-3))));
        found->chance *= passes;
        passes /= facets_hide(f, fmax(onward, R(1e-3)));
    } else {
        found->chance *= passes;
    }
    found->passes *= passes;
    return there;
}

// What a beam misses an end by, across its direction, and how it gets nearer where its beginning turns: by angles, of a place as it is seen
// from where its distance is told from.
typedef struct {
    real left;                  // how far it is to the end; below 0 it is behind
    real side, up;
    real side_by[2], up_by[2];
} beam_miss;

INLINE beam_miss beam_misses(const chain_beam *b, const chain_end *end) {
    beam_miss m;
    vec side, up;
    make_frame(b->way, &side, &up);
    const vec rest = vec_pick(end->far, end->at, vec_sub(end->at, b->at));
    const real share = R(1.0) / fmax(end->distance, (real)(REAL_SMALLEST)), scale = pick(end->far, R(1.0), share);
    m.left = vec_dot(rest, b->way);
    m.side = vec_dot(rest, side) * scale;
    m.up = vec_dot(rest, up) * scale;
    for (int i = 0; i < 2; ++i) {
        // Neighbours of the ray leave the boundary elsewhere, too.
        const vec ends = vec_pick(end->far, b->turns[i], vec_scale(vec_along(b->moves[i], m.left, b->turns[i]), share));
        m.side_by[i] = vec_dot(ends, side);
        m.up_by[i] = vec_dot(ends, up);
    }
    return m;
}

INLINE real miss_turns(const beam_miss *m) { return m->side_by[0] * m->up_by[1] - m->side_by[1] * m->up_by[0]; }

// Brings a ray over a body's boundaries, as in `chain_followed`; the result says whether it gets through.
INLINE mask chain_through(object_record o, const facets *f, real index, const vec *from, const vec *toward, const vec *place, mask within,
                          chain_beam *b, chain *found) {
    chain_site site;
    const vec none = vec_of(R(0.0), R(0.0), R(0.0));
    *b = (chain_beam){*from, *toward, {none, none}, {none, none}};
    make_frame(*toward, &b->turns[0], &b->turns[1]);
    vec at = *place;
    real distance = vec_dot(vec_sub(at, *from), b->way);
    if (is_ball(o)) {
        const vec offset = vec_sub(vec_splat(o->middle), *from);
        const real along = vec_dot(offset, b->way);
        const vec across = vec_along(offset, -along, b->way);
        distance = along - sqrt(fmax((real)(o->sides[0] * o->sides[0]) - vec_dot(across, across), R(0.0)));
        at = vec_along(*from, distance, b->way);
    } else if (is_shot(o)) {
        distance = shape_crossed(o, from, &b->way, 0);
        at = object_place(o, vec_along(*from, distance, b->way));
    }
    found->passes = found->chance = R(1.0);
    mask there = beam_crosses(o, f, 0, b, distance, at, pick(within, index, R(1.0) / index), &site, found);
    found->enters = found->leaves = at;
    found->before = found->beyond = site.normal;
    if (crosses_twice(o)) {
        if (is_shot(o)) {
            distance = shape_crossed(o, &at, &b->way, 1);
            at = object_place(o, vec_along(at, distance, b->way));
        } else {
            distance = R(-2.0) * (real)(o->sides[0]) * vec_dot(b->way, site.normal);
            at = vec_along(at, distance, b->way);
        }
        there &= beam_crosses(o, f, 1, b, distance, at, index, &site, found);
        found->leaves = at;
        found->beyond = site.normal;
    }
    found->arrives = b->way;
    return there;
}

// Follows a ray over a body's boundaries: over a level at a `place` of it, from `within` the body or from outside.
CALLED chain chain_followed(object_record o, const facets *f, real index, const vec *from, const vec *toward, const vec *place, mask within,
                            const chain_end *end) {
    chain found;
    chain_beam b;
    const mask there = chain_through(o, f, index, from, toward, place, within, &b, &found);
    const beam_miss missed = beam_misses(&b, end);
    found.turns = fabs(miss_turns(&missed));
    found.fails = number_of(~there | ~less(R(0.0), missed.left) | ~less(CHAIN_TURNS, found.turns));
    return found;
}
