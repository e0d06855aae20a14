// Several solids as one: formulas that have places of their own, and simple solids, joined one after the other. What looks for a
// surface, or asks how an orbit goes, asks this as it asks the functions of one formula (orbit.h).
//
// From the generated text: SOLIDS, the number of solids, the first of which is the scene's own formula; EACH_TEXT(DO), which does
// something for the number of each text of a formula (`orbit_dual_distance_0` and so on); JOINS_SMOOTHLY.
//
// Distances here are those that rays may go: of formulas with their step scale. They are 0 inside, and below 0 in simple solids. A
// cut is the larger of the one distance and of the other's negative, an intersection the larger of both (Hart 1996, "Sphere tracing").

// Farther out than this part of its ball's radius, a formula is not asked: the distance of the ball is enough, and estimates are
// made for its inside.
#define SOLID_NEAR R(0.01)
#define SOLID_BESIDE R(0.5)  // of its radius around the ball: here it has a gradient and a count, for light is computed before surfaces

// What is asked of solids: how far rays may go; the gradient, too; or the estimate of the distance, however far out.
#define ASK_STEP 0
#define ASK_GRADIENT 1
#define ASK_ESTIMATE 2
#define ASKS_FAR(asks) (asks == ASK_ESTIMATE || JOINS_SMOOTHLY)  // what flows together must not flow to the ball

#include "memory.h"
INLINE vec solid_own(__constant const struct Orbit *o, vec point) {
    const vec a = vec_sub(point, vec_splat(o->middle));
    return vec_of(vec_dot(a, vec_splat(o->own_x)), vec_dot(a, vec_splat(o->own_y)), vec_dot(a, vec_splat(o->own_z)));
}

// A gradient in its own units as a direction of space.
INLINE vec solid_turned(__constant const struct Orbit *o, vec own) {
    const vec x = vec_scale(vec_splat(o->own_x), own.x), y = vec_scale(vec_splat(o->own_y), own.y);
    return vec_normalize(vec_add(vec_add(x, y), vec_scale(vec_splat(o->own_z), own.z)));
}

// What is known of a point and one solid: how far it is, below 0 in simple solids.
typedef struct {
    real far, scale;
    mask inside;
    surface_point surface;
} solid_found;

INLINE real above_length(real a, real b, real c) {
    const real x = fmax(a, R(0.0)), y = fmax(b, R(0.0)), z = fmax(c, R(0.0));
    return sqrt(x * x + y * y + z * z);
}

// A plane, ball, box or cylinder, in whose own units its sides are at -1 and 1. With unequal factors along its axes the distances of
// balls and cylinders are too small, but not their directions.
INLINE void solid_simple(__constant const struct Orbit *o, vec own, solid_found *found) {
    const real sx = (real)(o->sides[0]), sy = (real)(o->sides[1]), sz = (real)(o->sides[2]);
    vec n = vec_of(R(0.0), R(0.0), R(1.0));
    if (o->kind == SOLID_PLANE) {
        found->far = own.z;
    } else if (o->kind == SOLID_SPHERE) {
        found->far = (sqrt(vec_dot(own, own)) - R(1.0)) * fmin(fmin(sx, sy), sz);
        n = own;
    } else if (o->kind == SOLID_BOX) {
        const real x = (fabs(own.x) - R(1.0)) * sx, y = (fabs(own.y) - R(1.0)) * sy, z = (fabs(own.z) - R(1.0)) * sz;
        const real within = fmax(fmax(x, y), z);
        found->far = above_length(x, y, z) + fmin(within, R(0.0));
        // Outside towards the nearest place of the box, inside to its nearest side. (In its own units, so by its sides once more.)
        const mask out = less(R(0.0), within);
        const real least = pick(out, R(0.0), within);
        n.x = copysign(pick(less(x, least), R(0.0), pick(out, x, R(1.0))) * sx, own.x);
        n.y = copysign(pick(less(y, least), R(0.0), pick(out, y, R(1.0))) * sy, own.y);
        n.z = copysign(pick(less(z, least), R(0.0), pick(out, z, R(1.0))) * sz, own.z);
    } else {
        const real arm = sqrt(own.x * own.x + own.y * own.y), thin = fmin(sx, sy);
        const real side = (arm - R(1.0)) * thin, lid = (fabs(own.z) - R(1.0)) * sz, within = fmax(side, lid);
        found->far = above_length(side, lid, R(0.0)) + fmin(within, R(0.0));
        const mask out = less(R(0.0), within);
        const real across = pick(out, fmax(side, R(0.0)), pick(less(lid, side), R(1.0), R(0.0))) * thin / fmax(arm, R(1e-30));
        const real along = pick(out, fmax(lid, R(0.0)), pick(less(lid, side), R(0.0), R(1.0))) * sz;
        n = vec_of(across * own.x, across * own.y, copysign(along, own.z));
    }
    found->inside = less_equal(found->far, R(0.0));
    found->surface.gradient = solid_turned(o, n);
}

// One solid. With a gradient wanted the Jacobian's distance; else the formula's own, which is asked in the lanes that are near.
INLINE solid_found solid_ask(__constant const struct Orbit *o, vec point, mask active, int asks, real *cost,
                           __constant const scalar *k) {
    solid_found found;
    const real none = R(0.0);
    found.surface.square = found.surface.square_before = found.surface.count = none;
    found.surface.of = found.surface.solid = none;
    found.surface.gradient = vec_of(none, none, none);
    const vec own = solid_own(o, point);
    if (o->kind != SOLID_FORMULA) {
        solid_simple(o, own, &found);
        return found;
    }
    const vec arm = vec_sub(point, vec_splat(o->ball));
    found.far = sqrt(vec_dot(arm, arm)) - (real)(o->ball_radius);
    found.inside = active & ~active;
    found.surface.gradient = vec_normalize(arm);
    const mask beside = active & less(found.far, SOLID_BESIDE * (real)(o->ball_radius));
    const mask within = active & less(found.far, (ASKS_FAR(asks) ? SOLID_BESIDE : SOLID_NEAR) * (real)(o->ball_radius));
    const mask near = asks == ASK_STEP ? within : beside;
    if (!any_lane(near)) return found;
    clearance here = {R(0.0), {R(0.0), near}};
    surface_point there = found.surface;
    k += o->first;
#if HAS_DERIVATIVE
#define ASK_TEXT(i)                                                                                        \
    case i:                                                                                                \
        if (asks == ASK_GRADIENT) here = orbit_dual_distance_##i(own, near, o, k, &there);                 \
        else here = orbit_scalar_distance_##i(own, near, o, k);                                            \
        break;
#else
#define ASK_TEXT(i)                                                                                        \
    case i: here = orbit_dual_distance_##i(own, near, o, k, &there); break;
#endif
    switch (o->text) { EACH_TEXT(ASK_TEXT) }
    found.far = pick(within, here.step * (real)(o->scale), found.far);
    found.inside = within & here.end.inside;
    found.surface.count = here.end.count;
    *cost += pick(near, here.end.count, none);
    if (HAS_DERIVATIVE && asks != ASK_GRADIENT) return found;
    found.surface.gradient = vec_pick(near, solid_turned(o, there.gradient), found.surface.gradient);
    found.surface.square = there.square;
    found.surface.square_before = there.square_before;
    return found;
}

INLINE surface_point surface_pick(mask m, surface_point yes, surface_point no) {
    surface_point s;
    for (int i = 0; i < NUMBERS_OF(surface_point); ++i) ((real *)&s)[i] = pick(m, ((const real *)&yes)[i], ((const real *)&no)[i]);
    return s;
}

// Joins one more solid to those before it. `rounding`: what a place is not known better than.
INLINE void solid_join(__constant const struct Orbit *o, solid_found *all, solid_found more, real rounding) {
    if (o->join == JOIN_CUT) {
        more.far = -more.far;
        more.surface.gradient = vec_scale(more.surface.gradient, R(-1.0));
    }
    if (o->join == JOIN_CUT || o->join == JOIN_INTERSECTION) {
        // A place that a search has put on a wall may lie behind it by rounding: it is on the wall.
        const real wall = o->kind == SOLID_FORMULA ? R(0.0) : rounding;
        const mask counts = less(all->far, more.far + wall);
        // The wall of a simple solid is a part of what it cuts: its orbits are that formula's.
        if (o->kind != SOLID_FORMULA) {
            more.surface.square = all->surface.square;
            more.surface.square_before = all->surface.square_before;
            more.surface.count = all->surface.count;
            more.surface.of = all->surface.of;
        }
        all->surface = surface_pick(counts, more.surface, all->surface);
        all->scale = pick(counts, more.scale, all->scale);
        all->far = fmax(all->far, more.far);
        all->inside &= o->kind == SOLID_FORMULA ? more.inside : less(more.far, -wall);
        return;
    }
    const mask nearer = less(more.far, all->far);
#if JOINS_SMOOTHLY
    if (o->join == JOIN_SMOOTH) {
        // The smooth minimum of Quilez, of distances as they are: between both, a quarter of the width is added at most.
        const real width = (real)(o->smoothness), a = all->far / all->scale, b = more.far / more.scale;
        const real share = fmax(width - fabs(a - b), R(0.0)) / width;
        const mask flows = less(R(0.0), share), closer = less(b, a);
        const real others = R(0.5) * share, of_more = pick(closer, R(1.0) - others, others);
        const vec gradient = vec_along(vec_scale(all->surface.gradient, R(1.0) - of_more), of_more, more.surface.gradient);
        const real lower = fmin(a, b) - R(0.25) * width * share * share, scale = fmin(all->scale, more.scale);
        const mask other = (flows & closer) | (~flows & nearer);
        all->surface = surface_pick(other, more.surface, all->surface);
        all->surface.gradient = vec_pick(flows, gradient, all->surface.gradient);
        all->far = pick(flows, lower * scale, fmin(all->far, more.far));
        all->scale = pick(flows, scale, pick(nearer, more.scale, all->scale));
        all->inside |= more.inside | (flows & less_equal(lower, R(0.0)));
        return;
    }
#endif
    all->surface = surface_pick(nearer, more.surface, all->surface);
    all->scale = pick(nearer, more.scale, all->scale);
    all->far = fmin(all->far, more.far);
    all->inside |= more.inside;
}

// All of them.
CALLED clearance solids_distance(const vec *point, mask active, int asks, __constant const struct Orbit *orbit,
                                __constant const scalar *k, surface_point *surface) {
    solid_found all;
    real cost = R(0.0);
    const real rounding = R(8.0) * (real)(REAL_EPSILON) * (fabs(point->x) + fabs(point->y) + fabs(point->z));
    for (int i = 0; i < SOLIDS; ++i) {
        __constant const struct Orbit *o = orbit + i;
        solid_found one = solid_ask(o, *point, active, asks, &cost, k);
        one.scale = (real)(o->step_scale);
        one.surface.of = (real)((scalar)i);
        one.surface.solid = (real)((scalar)o->object);
        if (i == 0) all = one;
        else solid_join(o, &all, one, rounding);
    }
    *surface = all.surface;
    const mask inside = active & all.inside;
    const clearance result = {pick(inside, R(0.0), fmax(all.far, R(0.0)) / all.scale), {cost, inside}, all.scale};
    return result;
}

INLINE clearance orbit_dual_distance(vec point, mask active, __constant const struct Orbit *orbit, __constant const scalar *k,
                                     surface_point *surface) {
    return solids_distance(&point, active, ASK_GRADIENT, orbit, k, surface);
}

// The estimate, which rays may go within the balls of formulas only.
INLINE clearance orbit_distance(vec point, mask active, __constant const struct Orbit *orbit, __constant const scalar *k) {
    surface_point ignored;
    return solids_distance(&point, active, ASK_ESTIMATE, orbit, k, &ignored);
}

#if HAS_DERIVATIVE
INLINE clearance orbit_scalar_distance(vec point, mask active, __constant const struct Orbit *orbit,
                                       __constant const scalar *k) {
    surface_point ignored;
    return solids_distance(&point, active, ASK_STEP, orbit, k, &ignored);
}

INLINE void orbit_scalar_distances(const vec *points, const mask *active, clearance *found, __constant const struct Orbit *orbit,
                                   __constant const scalar *k) {
    for (int i = 0; i < 2; ++i) found[i] = orbit_scalar_distance(points[i], active[i], orbit, k);
}
#endif

// Which points belong to the solid of `limit` applications, if that is not the scene's own limit; then each has its own.
CALLED orbit_end solids_inside(const vec *point, mask active, int limit, __constant const struct Orbit *orbit,
                             __constant const scalar *k) {
#if JOINS_SMOOTHLY
    if (limit == orbit->iterations) {
        surface_point ignored;
        return solids_distance(point, active, ASK_STEP, orbit, k, &ignored).end;
    }
#endif
    orbit_end all = {R(0.0), active & ~active};
    for (int i = 0; i < SOLIDS; ++i) {
        __constant const struct Orbit *o = orbit + i;
        const vec own = solid_own(o, *point);
        mask inside = all.inside & ~all.inside;
        if (o->kind != SOLID_FORMULA) {
            solid_found found;
            solid_simple(o, own, &found);
            inside = active & found.inside;
        } else {
            const vec arm = vec_sub(*point, vec_splat(o->ball));
            const real radius = (R(1.0) + SOLID_NEAR) * (real)(o->ball_radius);
            const mask near = active & less(vec_dot(arm, arm), radius * radius);
            if (any_lane(near)) {
                const int most = limit == orbit->iterations ? o->iterations : limit;
                orbit_end end;
#define SOLID_TEXT(i) case i: end = orbit_solid_##i(own, near, most, o, k + o->first); break;
                switch (o->text) { EACH_TEXT(SOLID_TEXT) }
                all.count += pick(near, end.count, R(0.0));
                inside = near & end.inside;
            }
        }
        if (o->join == JOIN_CUT) all.inside &= ~inside;
        else if (o->join == JOIN_INTERSECTION) all.inside &= inside;
        else all.inside |= inside;
    }
    return all;
}

INLINE orbit_end orbit_solid(vec point, mask active, int limit, __constant const struct Orbit *orbit,
                             __constant const scalar *k) {
    return solids_inside(&point, active, limit, orbit, k);
}

INLINE mask orbit_inside(vec point, mask active, int limit, __constant const struct Orbit *orbit, __constant const scalar *k) {
    return orbit_solid(point, active, limit, orbit, k).inside;
}

// The smooth escape count of the formula that is nearest.
INLINE real smooth_count(orbit_end end, surface_point surface, __constant const struct Orbit *orbit) {
    real smooth = R(0.0);
    end.count = surface.count;
    for (int i = 0; i < SOLIDS; ++i) {
        __constant const struct Orbit *o = orbit + i;
        const mask here = equal(surface.of, (real)((scalar)i));
        if (o->kind != SOLID_FORMULA || !any_lane(here)) continue;
        real found;
#define SMOOTH_TEXT(i) case i: found = smooth_count_##i(end, surface, o); break;
        switch (o->text) { EACH_TEXT(SMOOTH_TEXT) }
        smooth = pick(here, found, smooth);
    }
    return smooth;
}

// The potential of the formula that is nearest, as if its ball were as large as the whole scene's; 0 on walls.
INLINE real potential(orbit_end end, surface_point surface, __constant const struct Orbit *orbit) {
    real all = R(0.0);
    end.count = surface.count;
    for (int i = 0; i < SOLIDS; ++i) {
        __constant const struct Orbit *o = orbit + i;
        const mask here = equal(surface.of, (real)((scalar)i)) & equal(surface.solid, (real)((scalar)o->object));
        if (o->kind != SOLID_FORMULA || !any_lane(here)) continue;
        real found;
#define POTENTIAL_TEXT(i) case i: found = potential_##i(end, surface, o); break;
        switch (o->text) { EACH_TEXT(POTENTIAL_TEXT) }
        all = pick(here, found * (real)(o->potential_share), all);
    }
    return all;
}
