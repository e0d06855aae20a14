// What looks for a surface, or asks how an orbit goes, asks this: a formula by itself (distances.h), or with JOINED several solids as one,
// which are a list: formulas that have places of their own, and simple solids, joined one after the other. The first is the scene's own
// formula.
//
// Distances here are those that rays may go: of formulas with their step scale. They are 0 inside, and below 0 in simple solids.

// Farther out than this part of its ball's radius, a formula is not asked: the distance of the ball is enough, and estimates are
// made for its inside.
#define SOLID_NEAR R(0.01)

// What is asked of solids: how far rays may go; the gradient, too, of the distance or the surface; the estimate of the distance, however
// far out; or behind the wall of a hollow that wall's gradient.
#define ASK_STEP 0
#define ASK_GRADIENT 1
#define ASK_SURFACE 2
#define ASK_ESTIMATE 3
#define ASK_BEHIND 4
#define ASKS_SURFACE(asks) (asks == ASK_SURFACE || asks == ASK_BEHIND)
#define ASKS_GRADIENT(asks) (asks == ASK_GRADIENT || ASKS_SURFACE(asks))

#include "formulas/distances.h"
#include "device/memory.h"
#include "formulas/simple_solids.h"
#include "formulas/solid_joins.h"

// One solid. With a gradient wanted the Jacobian's distance; else the formula's own, which is asked in the lanes that are near.
INLINE solid_found solid_ask(orbit_record o, vec point, mask active, int asks, real *cost, constants k) {
    solid_found found = {R(0.0)};
    const vec own = solid_own(o, point);
    if (o->kind != SOLID_FORMULA) {
        solid_simple(o, own, &found);
        found.near = found.apart = found.far;
        return found;
    }
    const vec arm = vec_sub(point, vec_splat(o->ball));
    found.apart = sqrt(vec_dot(arm, arm));
    found.far = found.apart - (real)(o->ball_radius);
    found.near = (real)(REAL_LARGEST);
    found.inside = active & ~active;
    found.surface.gradient = vec_normalize(arm);
    const mask beside = active & less(found.far, (real)(o->reach));
    // What flows together must not flow to the ball.
    const mask within = asks == ASK_ESTIMATE || o->flows ? beside : active & less(found.far, SOLID_NEAR * (real)(o->ball_radius));
    const mask near = asks == ASK_STEP ? within : beside;
    if (!any_lane(near)) return found;
    clearance here = {R(0.0), {R(0.0), near}, R(0.0)};
    surface_point there = found.surface;
    const int of = ASKS_SURFACE(asks) ? OF_SURFACE : OF_DISTANCE;
    k += o->first;
    if (HAS_DERIVATIVE && !ASKS_GRADIENT(asks)) here = formula_distance(own, near, o, k);
    else here = formula_dual_distance(own, near, of, o, k, &there);
    // (Outside the ball an estimate may be much too large.)
    const real farthest = pick(less(R(0.0), found.far), found.apart, (real)(REAL_LARGEST));
    const real estimate = least(here.step * (real)(o->scale), farthest);
    found.apart = pick(near, pick(within, estimate, most(estimate, found.far)), found.apart);
    found.far = pick(within, estimate, found.far);
    found.near = pick(within, estimate, found.near);
    found.inside = within & here.end.inside;
    found.surface.own.count = here.end.count;
    *cost += pick(near, here.end.count, R(0.0));
    if (HAS_DERIVATIVE && !ASKS_GRADIENT(asks)) return found;
    // Where the ball cuts the set, the surface is the ball's.
    const mask cut = here.end.inside & ~within;
    found.surface.gradient = vec_pick(near & ~cut, solid_turned(o, there.gradient), found.surface.gradient);
    if (asks == ASK_BEHIND) {
        // No wall is as deep in a set as this, and no gradient counts there.
        found.far = pick(found.inside, -(real)(REAL_LARGEST), found.far);
        found.near = found.apart = found.far;
        found.surface.gradient = vec_pick(found.inside, vec_of(R(0.0), R(0.0), R(0.0)), found.surface.gradient);
    }
    found.surface.own.square = there.own.square;
    found.surface.own.square_before = there.own.square_before;
    return found;
}

// All of them.
CALLED clearance solids_distance(const vec *point, mask active, int asks, orbit_record orbit,
                                constants k, surface_point *surface) {
    solid_found all;
    real cost = R(0.0);
    const real rounding = R(8.0) * (real)(REAL_EPSILON) * (fabs(point->x) + fabs(point->y) + fabs(point->z));
    for (int i = 0; i < orbit->solids; ++i) {
        orbit_record o = orbit + i;
        solid_found one = solid_ask(o, *point, active, asks, &cost, k);
        one.most = one.far;
        one.scale = (real)(o->step_scale);
        one.body = (real)((scalar)o->body);
        one.surface.own.of = (real)((scalar)i);
        one.surface.own.solid = (real)((scalar)o->object);
        solid_opened(o, *point, &one, rounding);
        if (i == 0) all = one;
        else solid_join(o, &all, one, rounding);
    }
    *surface = all.surface;
    const mask inside = active & all.inside;
    const real step = pick(inside, R(0.0), most(R(0.0), all.far) / all.scale);
    const real near = pick(inside, R(0.0), most(R(0.0), all.near) / all.scale);
    return (clearance){step, {cost, inside}, near, all.scale, pick(in_hollow(all), all.most / all.scale, step)};
}

INLINE clearance orbit_dual_distance(vec point, mask active, int of, orbit_record orbit, constants k, surface_point *surface) {
    if (!JOINED) return formula_dual_distance(point, active, of, orbit, k, surface);
    return solids_distance(&point, active, of == OF_SURFACE ? ASK_SURFACE : ASK_GRADIENT, orbit, k, surface);
}

// The estimate, which rays may go within the balls of formulas only; the most that it may be in hollows.
INLINE clearance orbit_distance(vec point, mask active, orbit_record orbit, constants k) {
    if (!JOINED) return formula_distance(point, active, orbit, k);
    surface_point ignored;
    clearance found = solids_distance(&point, active, ASK_ESTIMATE, orbit, k, &ignored);
    found.step = found.most;
    return found;
}

// Behind the walls of hollows: their gradients and counts. There is no gradient where a place is in another solid, or still in the hollow.
INLINE clearance orbit_behind(vec point, mask active, orbit_record orbit, constants k, surface_point *surface) {
    return solids_distance(&point, active, ASK_BEHIND, orbit, k, surface);
}

// How far rays may go: by the scalar rule, if the formulas have one, else with the gradient. `late`: of the lanes that are given, those
// that go on with orbits `under_way`; and, as a result, those of which nothing is found yet.
INLINE clearance orbit_step(march_orbit *under_way, vec point, mask active, mask *late, orbit_record orbit, constants k,
                            surface_point *surface) {
#if HAS_DERIVATIVE
    if (!JOINED) return formula_scalar_orbit(under_way, point, active, late, CARRIED, orbit, k);
    return solids_distance(&point, active, ASK_STEP, orbit, k, surface);
#else
    dual_limit none = dual_limit_none(active);
    if (!JOINED) return formula_dual_orbit(under_way, point, active, late, OF_DISTANCE, CARRIED, &none, orbit, k, surface);
    return solids_distance(&point, active, ASK_GRADIENT, orbit, k, surface);
#endif
}

#if HAS_DERIVATIVE
// The same of two packets.
INLINE void orbit_steps(march_orbit *a, march_orbit *b, const vec *points, const mask *active, mask *late, clearance *found,
                        orbit_record orbit, constants k) {
    if (!JOINED) {
        formula_scalar_orbits(a, b, points, active, late, CARRIED, found, orbit, k);
        return;
    }
    surface_point ignored;
    for (int i = 0; i < 2; ++i) found[i] = solids_distance(points + i, active[i], ASK_STEP, orbit, k, &ignored);
}
#endif

// Which part of a distance rays may go; `own`: of a formula by itself.
INLINE real step_scale_of(clearance here, scalar own) { return JOINED ? here.scale : (real)(own); }

// Which points belong to the solid of `limit` applications, if that is not the scene's own limit; then each has its own. `body`: the body
// there that light goes through, or BODY_OPAQUE; the highest of several, and in the open 0.
CALLED orbit_end solids_inside(const vec *point, mask active, int limit, real *body, orbit_record orbit, constants k) {
    orbit_end all = {R(0.0), active & ~active};
    *body = R(0.0);
    if (orbit->flows && limit == orbit->iterations) {
        surface_point ignored;
        all = solids_distance(point, active, ASK_STEP, orbit, k, &ignored).end;
        *body = pick(all.inside, (real)((scalar)orbit->body), R(0.0));
        return all;
    }
    for (int i = 0; i < orbit->solids; ++i) {
        orbit_record o = orbit + i;
        const vec own = solid_own(o, *point);
        mask inside = all.inside & ~all.inside;
        if (o->kind != SOLID_FORMULA) {
            inside = active & simple_holds(o, own);
        } else {
            const vec arm = vec_sub(*point, vec_splat(o->ball));
            const real radius = (R(1.0) + SOLID_NEAR) * (real)(o->ball_radius);
            const mask near = active & less(vec_dot(arm, arm), radius * radius);
            if (any_lane(near)) {
                const int own_limit = limit == orbit->iterations ? o->iterations : limit;
                const orbit_end end = formula_end(own, near, own_limit, o, k + o->first);
                all.count += pick(near, end.count, R(0.0));
                inside = near & end.inside;
            }
        }
        inside = solid_left(o, *point, inside);
        all.inside = inside_joined(o->join, all.inside, inside);
        *body = pick(all.inside, fmax(*body, pick(inside, (real)((scalar)o->body), R(0.0))), R(0.0));
    }
    return all;
}

INLINE orbit_end orbit_solid(vec point, mask active, int limit, orbit_record orbit, constants k) {
    if (!JOINED) return formula_end(point, active, limit, orbit, k);
    real ignored;
    return solids_inside(&point, active, limit, &ignored, orbit, k);
}

// The same at the formulas' own limits, with the body there; one formula by itself is of the body `own`.
INLINE orbit_end orbit_bodies(vec point, mask active, real own, real *body, orbit_record orbit, constants k) {
    if (JOINED) return solids_inside(&point, active, orbit->iterations, body, orbit, k);
    const orbit_end end = formula_end(point, active, orbit->iterations, orbit, k);
    *body = pick(end.inside, own, R(0.0));
    return end;
}

// Where the list begins of what belongs to a body alone, in records; 0 where there is none.
INLINE int list_of_body(int body, orbit_record orbit) {
    for (int at = orbit->next_list; JOINED && at > 0;) {
        if (orbit[at].body == body) return at;
        const int next = orbit[at].next_list;
        at = next > 0 ? at + next : 0;
    }
    return 0;
}

INLINE mask orbit_inside(vec point, mask active, int limit, orbit_record orbit, constants k) {
    return orbit_solid(point, active, limit, orbit, k).inside;
}

// The smooth escape count of one formula; 0 of a simple solid. `known`: of which lanes there is one.
INLINE real smooth_of_one(orbit_end end, orbit_result one, mask *known, orbit_record orbit) {
    real smooth = R(0.0);
    end.count = one.count;
    *known = end.inside & ~end.inside;
    for (int i = 0; i < orbit->solids; ++i) {
        orbit_record o = orbit + i;
        const mask here = equal(one.of, (real)((scalar)i));
        if (o->kind != SOLID_FORMULA || !any_lane(here)) continue;
        smooth = pick(here, formula_smooth_count(end, one, o), smooth);
        *known |= here;
    }
    return smooth;
}

// The smooth escape count of the formula that is nearest; where two flow together, between theirs.
INLINE real smooth_count(orbit_end end, surface_point surface, orbit_record orbit) {
    if (!JOINED) return formula_smooth_count(end, surface.own, orbit);
    mask known;
    const real own = smooth_of_one(end, surface.own, &known, orbit);
    const mask flows = less(R(0.0), surface.share);
    if (!any_lane(flows)) return own;
    mask other_known;
    const real other = smooth_of_one(end, surface.other, &other_known, orbit);
    return shared(own, other, flows & known, flows & other_known, surface.share);
}

// The potential of the formula that is nearest, as if its ball were as large as the whole scene's; 0 on walls.
INLINE real potential(orbit_end end, surface_point surface, orbit_record orbit) {
    if (!JOINED) return formula_potential(end, surface.own, orbit);
    real all = R(0.0);
    end.count = surface.own.count;
    for (int i = 0; i < orbit->solids; ++i) {
        orbit_record o = orbit + i;
        const mask here = equal(surface.own.of, (real)((scalar)i)) & equal(surface.own.solid, (real)((scalar)o->object));
        if (o->kind != SOLID_FORMULA || !any_lane(here)) continue;
        all = pick(here, formula_potential(end, surface.own, o) * (real)(o->potential_share), all);
    }
    return all;
}
