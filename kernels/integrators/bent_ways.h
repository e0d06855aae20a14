// Ways over the boundaries of clear bodies by which the light that was chosen at an event comes there, of which one is taken.
#include "integrators/ball_search.h"
#include "integrators/level_search.h"

// Where lights are sampled for.
typedef struct {
    vec from, normal;
    real medium;
    mask wanted;
} bent_event;

// A place of a light, or its direction, as it is chosen for a body.
typedef struct {
    chain_end end;
    vec straight;       // there from where the density of the choice is told from
    vec normal;         // of the light, of any length; 0: from all sides the same
    light_ray ray;
    real share;         // of all lights, that this one is chosen
    real number;        // which one
    vec point;          // the event, as lights without a size see it
} bent_end;

// What a chain brings.
typedef struct {
    vec toward;       // in which it leaves the event
    color through;    // part of the light that comes, but for what the light itself shows
    real chance;      // with which a path goes through the boundaries
    real narrows;     // solid angle there over that of the light as it was chosen
    real chances;     // 1 over the probability of having found it
    real lift;        // how far over its boundaries rays are sure to begin on the right side
    real two;         // whether it crosses two boundaries
    chain way;
    color light;      // what the light shows, and with which density its place was chosen, per steradian
    real density;
    vec end;
    real end_far;
} bent_way;
NUMBERS_PICKED(bent_way)

// Of a body of another shape: `shape_search.h`, or `plain_bodies.h`.
CALLED mask shape_chain(object_record o, const facets *f, real index, const vec *from, const chain_end *end, real least, bits seed, mask wanted,
                        vec *toward, real *chances);

// One way of those that have been found: by a number in (0, 1), and the sum of their weights so far.
typedef struct {
    real number, all, weight;
    bent_way way;
} bent_choice;

INLINE void way_takes(bent_choice *c, const bent_way *b, real weight, mask here) {
    here &= less(R(0.0), weight);
    c->all += pick(here, weight, R(0.0));
    const real share = pick(here, weight / fmax(c->all, (real)(REAL_SMALLEST)), R(0.0));
    const mask takes = here & less(c->number, share);
    const real left = pick(takes, c->number / fmax(share, (real)(REAL_SMALLEST)), (c->number - share) / fmax(R(1.0) - share, (real)(REAL_EPSILON)));
    c->number = clamp(left, R(0.0), R(1.0) - (real)(REAL_EPSILON));
    c->weight = pick(takes, weight, c->weight);
    c->way = bent_way_pick(takes, *b, c->way);
}

INLINE real bent_index(object_record o, world w) {
    __constant const struct Pbr *m = w.materials + o->material;
    const real ior = (real)(m->specular_ior), root = fmin((ior - R(1.0)) / (ior + R(1.0)) * sqrt((real)(m->specular_weight)), R(0.98));
    return fmax((R(1.0) + root) / (R(1.0) - root), GLASS_LEAST);
}

// From where places of lights are chosen for chains over a body: what is seen from there is seen from where these leave it, but for little.
INLINE vec bent_vantage(object_record o, vec from) {
    const vec middle = vec_splat(o->middle), up = vec_splat(o->own_z);
    if (is_shot(o)) {
        // The place nearest to it of a box within, which the body is as far around as it is thin: of a pane all of its middle.
        const scalar thin = fmin(fmin(o->sides[0], o->sides[1]), o->sides[2]);
        const vec own = object_own(o, vec_sub(from, middle));
        vec within;
#define WITHIN(c, i) within.c = (real)(o->sides[i] * o->sides[i]) * clamp(own.c, (real)(thin / o->sides[i] - S(1.0)), (real)(S(1.0) - thin / o->sides[i]))
        WITHIN(x, 0);
        WITHIN(y, 1);
        WITHIN(z, 2);
#undef WITHIN
        return vec_add(middle, vec_of_axes(o, within));
    }
    return is_ball(o) ? middle : vec_along(from, -vec_dot(vec_sub(from, middle), up), up);
}

// Facets of its boundary that are not known yet: the axis is never along the normals of most chains.
INLINE facets facets_of(object_record o, vec from, world w) {
    vec side, up;
    make_frame(vec_normalize(vec_sub(vec_splat(o->middle), from)), &side, &up);
    const vec across = vec_along(vec_scale(side, R(0.8)), R(0.6), up);
    return no_facets(crosses_twice(o) ? across : vec_splat(o->own_x), facets_wide(o, w));
}

// How much narrower a place of a light is across the direction in which a chain arrives than as it was chosen, by its normal; 0 where one of
// both sees its other side.
INLINE real faces_bent(vec normal, vec straight, vec arrives) {
    const real as_chosen = -vec_dot(normal, straight), bent_on = -vec_dot(normal, arrives);
    const mask none = equal(vec_dot(normal, normal), R(0.0)), shown = less(R(0.0), as_chosen) & less(R(0.0), bent_on);
    return pick(none, R(1.0), pick(shown, bent_on / pick(shown, as_chosen, R(1.0)), R(0.0)));
}

// The same of lights without a size: what they show where the chain leaves the body, at the distance of the event.
INLINE real shows_bent(const bent_end *to, vec leaves, world w) {
    real shows = R(1.0);
    mask left = less(R(0.0), R(1.0)), here;
    for (int i; (i = next_chosen(to->number, &left, &here)) >= 0;) {
        light_record light = w.lights + i;
        if (light->far || light->seen) continue;
        const incidence last = light_at(light, leaves, w.tables), as_seen = light_at(light, to->point, w.tables);
        const real nearer = last.distance / as_seen.distance;
        const real own = last.strength * (light->inverse_square ? nearer * nearer : R(1.0)) / fmax(as_seen.strength, R(1e-20));
        shows = pick(here, own, shows);
    }
    return shows;
}

// A chain over a body becomes a way, and is taken or not.
CALLED void chain_takes(object_record o, const bent_event *e, const bent_end *to, const chain *c, const vec *toward, real chances, mask within,
                        mask here, bent_choice *chosen, world w) {
    __constant const struct Pbr *m = w.materials + o->material;
    bent_way b;
    b.way = *c;
    b.toward = *toward;
    b.chances = chances;
    const int twice = crosses_twice(o);
    b.two = twice ? R(1.0) : R(0.0);
    const color tint = color_splat(m->transmission_color), white = color_of(R(1.0), R(1.0), R(1.0));
    const vec inner = vec_sub(twice ? c->leaves : vec_pick(within, e->from, to->end.at), c->enters);
    const real way = twice ? sqrt(vec_dot(inner, inner)) : pick(within | ~to->end.far, sqrt(vec_dot(inner, inner)), R(0.0));
    b.through = m->transmission_depth > S(0.0) ? absorbed(white, absorption_of(tint, (real)(m->transmission_depth)), way) : tint;
    scalar weight = m->transmission_weight;
    if (twice) {
        weight *= weight;
        if (m->transmission_depth <= S(0.0)) b.through = color_mul(b.through, tint);
    }
    b.chance = c->chance;
    b.through = color_scale(b.through, c->passes * (real)(weight));
    b.narrows = shows_bent(to, c->leaves, w) * faces_bent(to->normal, to->straight, c->arrives) / fmax(c->turns, CHAIN_TURNS);
    b.lift = R(2.0) * LIFT_ERRORS * (real)(REAL_EPSILON) * ((real)(o->error_share) * fmax(largest_of(c->enters), largest_of(c->leaves)) + (real)(o->error));
    b.light = to->ray.light;
    b.density = to->ray.density;
    b.end = to->end.at;
    b.end_far = number_of(to->end.far);
    // About what it will bring: what paths meet by chance keep themselves where the light is seen large.
    const real cosine = fabs(vec_dot(e->normal, *toward)) + R(0.01), met = b.narrows * b.chance * R(0.3) * number_of(less(R(0.0), b.density));
    const real counts = b.narrows / (R(1.0) + met / fmax(to->share * b.density, (real)(REAL_SMALLEST)));
    way_takes(chosen, &b, cosine * counts * brightest(color_mul(b.through, b.light)), here & ~mask_of(c->fails));
}

// All chains over a ball, from outside.
CALLED void ball_ways(object_record o, const bent_event *e, const bent_end *to, mask here, bent_choice *chosen, world w) {
    const real index = bent_index(o, w);
    const vec middle = vec_splat(o->middle), last = vec_sub(to->end.at, middle);
    const ball_plane b = ball_plane_of(o, index, e->from, &to->end);
    const real square = b.radius * b.radius;
    here &= less(b.radius, b.distance) & (to->end.far | less(square, vec_dot(last, last)));
    if (!any_lane(here)) return;
    const mask none = here & ~here;
    const facets flat = no_facets(middle, S(0.0));
    real away, across, place = R(-1.0), low_place = place, low = R(0.0);
    real misses = ball_misses(&b, place, &away, &across);
    for (int step = 1; step <= BALL_STEPS; ++step) {
        const real next = (real)(S(2.0) * (scalar)step / (scalar)BALL_STEPS - S(1.0)), at = ball_misses(&b, next, &away, &across);
        const mask negative = less(misses, R(0.0)), crossed = here & ((less(at, R(0.0)) & ~negative) | (~less(at, R(0.0)) & negative));
        real begin = place, begins = misses, end = next, ends = at, part = place, parts = misses;
        mask two = none;
        if (step > 1) {
            const mask alike = (less(low, R(0.0)) & negative) | (~less(low, R(0.0)) & ~negative);
            two = here & ~crossed & alike & less_equal(fabs(misses), fabs(low)) & less_equal(fabs(misses), fabs(at));
            if (any_lane(two)) two = ball_parts(&b, low_place, low, &part, &parts, next, at, two);
            begin = pick(two, low_place, begin);
            begins = pick(two, low, begins);
            end = pick(two, part, end);
            ends = pick(two, parts, ends);
        }
        for (int second = 0; second < 2; ++second) {
            const mask found = second ? two : crossed | two;
            if (!any_lane(found)) break;
            const real root = second ? ball_crossing(&b, part, parts, next, at, found) : ball_crossing(&b, begin, begins, end, ends, found);
            ball_misses(&b, root, &away, &across);
            const vec toward = vec_normalize(vec_along(vec_scale(b.away, away), across, b.across));
            const chain c = chain_followed(o, &flat, index, &e->from, &toward, &middle, none, &to->end);
            chain_takes(o, e, to, &c, &toward, R(1.0), none, found, chosen, w);
        }
        low_place = place;
        low = misses;
        place = next;
        misses = at;
    }
}

// One chain over a level, from within its body or from outside, or from outside through a body of another shape.
CALLED void searched_ways(object_record o, const bent_event *e, const bent_end *to, mask within, bits seed, mask here, bent_choice *chosen,
                          world w) {
    const real index = bent_index(o, w);
    vec place = vec_splat(o->middle), toward;
    real chances;
    facets f = facets_of(o, e->from, w);
    if (f.wide > S(0.0)) facets_drawn(&f, seed);
    // Below it paths meet the light about as often by chance.
    const real least = pick(less(R(0.0), to->ray.density), R(0.3) / fmax(to->share * to->ray.density, (real)(REAL_SMALLEST)), R(0.0));
    if (is_shot(o)) {
        here &= shape_chain(o, &f, index, &e->from, &to->end, least, seed, here, &toward, &chances);
    } else {
        here &= level_chain(o, &f, index, &e->from, &to->straight, within, &to->end, least, seed, here, &place, &chances);
        toward = vec_normalize(vec_sub(place, e->from));
    }
    if (!any_lane(here)) return;
    const chain c = chain_followed(o, &f, index, &e->from, &toward, &place, within, &to->end);
    chain_takes(o, e, to, &c, &toward, chances, within, here, chosen, w);
}

// A place of it that was sampled from a vantage.
INLINE void end_takes(bent_end *to, vec *begin, vec *told_from, mask here, light_ray r, vec vantage, vec normal) {
    to->ray.toward = vec_pick(here, r.toward, to->ray.toward);
    to->ray.distance = pick(here, r.distance, to->ray.distance);
    to->ray.light = color_pick(here, r.light, to->ray.light);
    to->ray.density = pick(here, r.density, to->ray.density);
    *begin = vec_pick(here, vantage, *begin);
    *told_from = vec_pick(here, vantage, *told_from);
    to->normal = vec_pick(here, normal, to->normal);
}

// The place of the light that was chosen at an event, as it is seen from a vantage.
INLINE bent_end end_chosen(const choosing *c, vec from, vec vantage, const real *numbers, real choice, world w) {
    bent_end to = {{c->found.ray.toward, equal(c->number, LIGHT_OF_ENVIRONMENT), (real)(REAL_LARGEST)}, c->found.ray.toward,
                   vec_of(R(0.0), R(0.0), R(0.0)), c->found.ray, c->found.share, c->number, c->point};
    vec begin = from, told_from = from;
    mask left = less(R(0.0), R(1.0)), same;
    for (int i; (i = next_chosen(c->number, &left, &same)) >= 0;) {
        light_record light = w.lights + i;
        const mask here = same;
        if (light->far) {
            to.end.far |= here;
        } else if (light->seen) {
            const light_ray r = light_sample(light, vantage, numbers[0], numbers[1], w.tables);
            end_takes(&to, &begin, &told_from, here, r, vantage, light_normal(light, vec_along(vantage, r.distance, r.toward)));
        } else {
            begin = vec_pick(here, c->point, begin);
        }
    }
    if (HAS(w, EMITTERS)) {
        for (int i = 0; i < w.settings->object_count; ++i) {
            object_record o = w.objects + i;
            const mask here = equal(c->number, LIGHT_OF_OBJECT(i));
            if (!o->sampled || !any_lane(here)) continue;
            const light_ray r = emitter_ray(o, vantage, choice, numbers[0], numbers[1]);
            end_takes(&to, &begin, &told_from, here, r, vantage, object_normal(o, vec_along(vantage, r.distance, r.toward), w.tables));
        }
    }
    const vec place = vec_along(begin, pick(to.end.far, R(0.0), to.ray.distance), to.ray.toward), offset = vec_sub(place, told_from);
    to.end.at = vec_pick(to.end.far, to.ray.toward, place);
    to.end.distance = pick(to.end.far, to.end.distance, sqrt(vec_dot(offset, offset)));
    to.straight = vec_pick(to.end.far, to.ray.toward, vec_normalize(offset));
    return to;
}

// A way over the boundaries of one body by which the light that was chosen comes to an event, from outside or from within a level's body.
CALLED mask bent_way_found(const bent_event *e, const choosing *c, const real *numbers, bits *stream, bent_choice *chosen, world w) {
    chosen->all = chosen->weight = R(0.0);
    chosen->number = next_random(stream);
    for (int n = 0; n < NUMBERS_OF(bent_way); ++n) ((real *)&chosen->way)[n] = R(0.0);
    const real choice = next_random(stream);
    for (int i = 0; i < w.settings->object_count; ++i) {
        object_record o = w.objects + i;
        if (!o->bends) continue;
        const mask outside = e->wanted & equal(e->medium, R(0.0)), within = e->wanted & equal(e->medium, (real)((scalar)(i + 1)));
        const mask here = crosses_twice(o) ? outside : outside | within;
        if (!any_lane(here)) continue;
        const bent_end to = end_chosen(c, e->from, bent_vantage(o, e->from), numbers, choice, w);
        const mask shines = here & less(R(0.0), brightest(to.ray.light));
        if (is_ball(o)) {
            ball_ways(o, e, &to, shines, chosen, w);
        } else {
            searched_ways(o, e, &to, within, hash_bits(*stream + (bits)((uint)(i + 1) * 0x9e3779b9u)), shines, chosen, w);
        }
    }
    return e->wanted & less(R(0.0), chosen->weight);
}
