// Sphere tracing (Hart 1996) of a packet of rays down to the solid itself.
//
// A ray's cone is `detail` times its pixel's footprint wide. Far from the solid steps follow the distance and how it changes
// along the ray; within a cone of it the change tells where the ray meets the solid, and the march lands there: close to it,
// or inside, which brackets the surface between two points.
#include "integrators/march/march_state.h"
#include "integrators/march/passed.h"
#include "formulas/proof.h"

#define SLOPE_GAIN R(0.3)        // part of a newly measured slope
#define LANDING R(1.0)           // of the cone: from this distance on the march lands
#define LANDING_AIM R(0.05)      // of the cone: the distance that a landing step aims at
#define LANDING_STEP R(1.0)      // of the cone: the longest landing step ...
#define LANDING_SHORT R(0.5)     // ... and that of rays that may meet sheets
#define LANDED R(0.6)            // of the cone: the solid expected so near ahead is hit ...
#define LANDED_MOST R(0.25)      // ... at a distance of at most this part of the cone
#define LANDED_LEAST R(0.03)     // a ray past the solid hits at this part of the cone: a smooth rim stays where it is
#define POINT_REACH R(1.35)      // a pixel's points hit at that much more ...
#define POINT_LEAST R(0.0075)    // ... but at their own rims they are as exact as they are many
// Rays that do not land hit where light is computed:
#define SEEN R(2.0)              // of the cone: the solid expected so near ahead is hit ...
#define SEEN_BRACKETED R(0.5)    // ... and so is a bracket this narrow
#define BRACKETED (HOLLOWS && settings->polish ? R(0.005) : R(0.1))  // of the cone: a bracket this narrow is the surface
#define LEAST_SLOPE R(0.1)       // no landing step is longer than ten distances ...
#define GRAZING_SLOPE R(0.01)    // ... but a hit may lie farther ahead ...
#define GRAZING_MOST R(2.0)      // ... at most so much of the cone
#define MOST_GROWTH R(0.5)       // of an unscaled distance for the way: where a surface is smooth it is half of the true one
#define SURE_GROWTH R(0.25)      // what is sure of one that grows faster, near the solid
#define CALM_GROWTH R(0.1)       // steps from distances that grow faster are no longer than these, near the solid
#define CLOSE R(4.0)             // cones: near the solid
#define BALL_NEAR R(1.005)       // of its radius: so near to the middle of a formula's ball its estimates count ...
#define BALL_BEYOND R(1.01)      // ... and beyond this they may be too large
#define CREEP R(0.25)            // of the cone: the least step by the Jacobian
#define CONE_LEAST R(0.25)       // of a cone of many rays: the least step that is worth another look
#define BACK_STEPS R(4.5)        // a point's evaluations inside, before it counts as hit where it begins
// In hollows, where no distance is known, rays go as in the search by steps; steps grow as those of its shadows do.
#define BLIND_FIRST R(2.0)       // of the cone: the first step ...
#define BLIND_LEAST R(0.015625)  // ... but at least this part of the full step
#define BLIND_GROWTH R(1.5)

// So many lanes have to be done before they take new rays. Packets that a work-item marches side by side: orbits over dual numbers fill a
// processor's registers and units without that, and calls empty the registers.
#define REFILL (LANES > 8 ? LANES / 8 : 1)
#define ABREAST (HAS_DERIVATIVE && !HAS_CALLS && LANES > 1 ? 2 : 1)
#define ORBITS_WAITED(m) (m)->under_way.lanes.waits

INLINE sight march_place(const march *m) {
    sight s;
    s.on_ray = vec_along(m->r.origin, m->t, m->r.direction);
    s.point = vec_pick(proof_under_way(m), m->probe, s.on_ray);
    return s;
}

// The step in a hollow: nothing counts as near there, but for what is joined to it.
INLINE void march_blind(const march *m, sight *s, march_record settings) {
    const real step = (real)(settings->step), first = most(BLIND_FIRST * s->cone, BLIND_LEAST * step);
    const real pace = least(most(first, BLIND_GROWTH * m->step_before), step);
    const real farthest = s->here.most * step_scale_of(s->here, settings->step_scale);
    const real free = least(most(most(s->cone, pace), s->radius), farthest);
    const mask unknown = is_blind(s->here);
    s->blind = unknown & less(free, farthest);
    s->sure = pick(unknown & ~s->blind, free, s->radius);
    s->radius = pick(unknown, free, s->radius);
}

// Estimates are made for the inside of the formula's ball. Farther out they may be too large: there no step leads into it. How far the
// ball is along the ray, and in `around` in any direction; beyond all where the ray does not meet it, or none goes so far.
INLINE real march_to_ball(const march *m, const sight *s, real *around, march_record settings) {
    *around = (real)(REAL_LARGEST);
    if (!settings->goes_far) return *around;
    const vec arm = vec_sub(s->on_ray, vec_splat(settings->ball_center));
    const real radius = (real)(settings->ball_radius), away = sqrt(vec_dot(arm, arm)), ahead = -vec_dot(arm, m->r.direction);
    const vec nearest = vec_along(arm, ahead, m->r.direction);
    const real square = BALL_NEAR * BALL_NEAR * radius * radius - vec_dot(nearest, nearest);
    const mask far = less(BALL_BEYOND * radius, away);
    *around = pick(far, away - radius, (real)(REAL_LARGEST));
    return pick(far & less(R(0.0), ahead) & less(R(0.0), square), ahead - sqrt(most(R(0.0), square)), (real)(REAL_LARGEST));
}

// What the distance found at that place means for the march.
INLINE void march_measure(march *m, sight *s, int goal, march_record settings) {
    const mask free = less_equal((real)(REAL_LARGEST), m->high) & ~proof_under_way(m);
    s->to_ball = march_to_ball(m, s, &s->around, settings);
    s->cone = (real)(settings->detail) * (m->r.footprint + m->r.spread * m->t);
    const real scale = step_scale_of(s->here, settings->step_scale);
    s->radius = s->here.step * scale;
    // Nothing is known where an orbit left the range of numbers at once: there rays go on as in the search by steps.
    s->radius = pick(less(s->radius, (real)(REAL_LARGEST)), s->radius, (real)(settings->step));
    // Where an estimate grows faster it has met a point at which the derivative vanishes, and means nothing: near the solid, where
    // such points crowd, it may be more than the true distance to a sheet.
    const real growth = scale * m->step_before;
    const mask capped = free & less(m->radius_before + MOST_GROWTH * growth, s->radius);
    const mask close = seeks_sheets(m, goal) & less(m->radius_before, CLOSE * s->cone);
    s->radius = pick(capped, m->radius_before + pick(close, SURE_GROWTH, MOST_GROWTH) * growth, s->radius);
    s->restless = free & close & less(m->radius_before + CALM_GROWTH * growth, s->radius);
    s->blind = less(R(1.0), R(0.0));
    s->sure = s->radius;
    if (HOLLOWS) march_blind(m, s, settings);
    s->near = JOINED ? pick(less(s->here.step, s->here.near), s->here.near * scale, s->radius) : s->radius;
    // (Orbits that are left under way count for themselves.)
    if (!CARRIES && settings->counts_waits) m->waits += orbit_waits(m->active, s->here.end.count);
    m->found.steps += pick(m->active, R(1.0), R(0.0));
    m->found.count += pick(m->active, s->here.end.count, R(0.0));
}

// Keeps where the cone has come near the solid: between two steps, so that it does not depend on how long they were.
INLINE void march_keep(march *m, const sight *s, mask outside, mask passed, mask inside, march_record settings) {
    const real height = s->cone * near_of(s->here, settings);
    const mask beside = outside & less(s->near, height) & ~s->blind;
    const mask first = outside & (~beside | less_equal((real)(REAL_LARGEST), m->found.touch));
    const mask between = beside & less(height, m->radius_before) & less(m->radius_before, (real)(REAL_LARGEST));
    const real back = pick(between, (height - s->near) / (m->radius_before - s->near), R(0.0));
    m->found.touch = pick(first, pick(beside, m->t - back * (m->t - m->low), (real)(REAL_LARGEST)), m->found.touch);
    m->low = pick(outside & ~passed, m->t, m->low);
    m->high = pick(inside, m->t, m->high);
}

// The next place of the lanes that march, which went `overshot` or not and have `slope` now.
INLINE void march_onward(march *m, const sight *s, mask marching, mask overshot, mask early, mask passed, real slope, int goal,
                         march_record settings) {
    // Where the distance falls like that of a plane, the next sphere touches this one at 2 / (1 - slope) radii (Ban and
    // Valasek 2023, Automatic step size relaxation in sphere tracing).
    const mask landing = marching & ~overshot & ~at_ball(s) & less(s->radius, goal == GOAL_SURFACE ? LANDING * s->cone : R(0.0));
    const real expected = (s->radius - LANDING_AIM * s->cone) / most(LEAST_SLOPE, -slope);
    const real longer = bounded(R(2.0) / (R(1.0) - march_slope(m, s, goal, settings)), R(1.0), (real)(settings->relaxation));
    const real relaxed = s->radius * pick(at_ball(s) | s->restless, R(1.0), longer);
    const real longest = pick(seeks_sheets(m, goal), LANDING_SHORT, LANDING_STEP) * s->cone;
    real step = pick(landing & ~s->restless, most(least(expected, longest), s->radius), relaxed);
    m->landing = (m->landing & ~marching) | landing;
    if (!HAS_DERIVATIVE) {
        m->landing |= marching & less(step, CREEP * s->cone);
        step = most(CREEP * s->cone, step);
    }
    m->limit = pick(overshot & s->here.end.inside, m->t, m->limit);
    step = pick(s->blind, s->radius, step);
    step = least(step, s->to_ball);
    step = least(step, m->limit - m->t);
    const real onward = pick(overshot, m->low + m->radius_before, m->t + step);
    m->step_before = pick(overshot, m->radius_before, pick(marching, step, m->step_before));
    m->slope = pick(overshot, R(-1.0), m->slope);
    const real known = pick(s->blind | at_ball(s), (real)(REAL_LARGEST), s->radius);
    m->radius_before = pick(marching & ~overshot & ~early & ~s->here.end.inside & ~passed, known, m->radius_before);
    const mask bracketed = marching & less(m->high, (real)(REAL_LARGEST));
    const real free = pick(is_blind(s->here), R(0.0), s->radius);
    const real narrower = most(R(0.5) * (m->low + m->high), least(m->low + free, m->high - BRACKETED * s->cone));
    m->t = pick(bracketed, narrower, pick(early, m->low, pick(marching, onward, m->t)));
    march_between(m, s, marching & ~bracketed);
}

// One step of cones: as far as the free sphere holds the cone's whole width. The lanes that go on remain active. A cone that
// leaves its ray's part ends beyond everything.
INLINE void march_cone(march *m, const sight *s, march_record settings) {
    const real widens = (real)(settings->detail) * m->r.spread, all = R(1.0) + widens * widens;
    const real free = (real)(settings->cone_share) * least(s->radius, s->around), square = free * free - s->cone * s->cone;
    const real along = (sqrt(most(R(0.0), s->cone * s->cone * widens * widens + all * square)) - s->cone * widens) / all;
    const mask known = less(s->here.step, (real)(REAL_LARGEST)) & ~is_blind(s->here);
    const mask onward = m->active & known & less(CONE_LEAST * s->cone, along) &
                        less(m->found.steps, (real)((scalar)settings->max_steps));
    m->radius_before = pick(m->active, s->radius, m->radius_before);
    m->step_before = pick(m->active, along, m->step_before);
    m->t += pick(onward, along, R(0.0));
    m->found.t = pick(m->active, pick(less(m->t, m->r.far), m->t, (real)(REAL_LARGEST)), m->found.t);
    m->active = onward & less(m->t, m->r.far);
}

// A pixel's point begins near where the pixel's cone touched the set. What is inside there steps back, farther each time, but not
// out of the bounds: the lanes that do.
INLINE mask march_too_early(march *m, mask inside, real cone, march_record settings) {
    const mask early = is_point(m) & inside & less_equal((real)(REAL_LARGEST), m->radius_before) & less(m->found.steps, BACK_STEPS);
    if (any_lane(early)) {
        ray whole = m->r;
        whole.near = R(0.0);
        ray_clip(&whole, settings->bounds_center, (real)(settings->bounds_radius));
        m->low = pick(early, most(m->t - cone * m->found.steps, whole.near), m->low);
    }
    return early;
}

// What the active lanes do after a look; those that arrive, or leave their ray's part, are active no longer.
INLINE void march_act(march *m, sight s, int goal, march_record settings, orbit_record orbit) {
    march_measure(m, &s, goal, settings);
    if (goal == GOAL_CONE) {
        march_cone(m, &s, settings);
        return;
    }
    const real cone = s.cone, radius = s.radius;
    const mask marching = proof_step(m, &s, settings, orbit);
    // If this sphere does not touch the one before, something may lie between them, so go back to the end of the one
    // before (Keinert et al. 2014, sec. 3.1).
    const mask free = marching & less_equal((real)(REAL_LARGEST), m->high);
    const mask overshot = free & ~m->landing & less((s.sure + m->radius_before) * R(1.0001), m->step_before);
    mask inside = marching & ~overshot & s.here.end.inside;
    const mask early = march_too_early(m, inside, cone, settings);
    inside &= ~early;
    const mask outside = marching & ~overshot & ~s.here.end.inside;
    // (Not where it has only just begun.)
    const mask knew = less(m->radius_before, (real)(REAL_LARGEST));
    m->found.bad += pick(inside & free & ~m->landing & less(R(1.5), m->found.steps) & (HOLLOWS ? knew : inside), R(1.0), R(0.0));
    const mask measured = outside & free & less(R(0.0), m->step_before) & knew & ~s.blind & ~at_ball(&s);
    real slope = bounded(pick(measured, (radius - m->radius_before) / m->step_before, m->slope), R(-1.0), R(0.9));
    // Points begin near the solid: their first look may be the last.
    slope = pick(is_point(m) & outside & ~knew, march_first_slope(m, &s, settings), slope);
    m->slope = pick(measured, m->slope + SLOPE_GAIN * (slope - m->slope), m->slope);
    m->slope = pick(s.blind, R(0.0), pick(at_ball(&s), SLOPE_AT_FIRST, m->slope));
    const mask passed = march_passed(m, &s, outside, inside, goal);
    march_keep(m, &s, outside, passed, inside, settings);

    // The cone touches the solid, or the surface is bracketed. A hit at first sight waits for a landing, unless it is as near as
    // one; a pixel's points begin near the solid, and stand for each other.
    const mask bracketed = marching & less(m->high, (real)(REAL_LARGEST));
    real reach = cone;
    mask touched = outside;
    if (goal == GOAL_SURFACE) {
        reach *= bounded(-LANDED * slope, LANDED_LEAST, LANDED_MOST);
        mask landed = m->landing | less(s.near, LANDED_LEAST * cone);
        if (!settings->lands) {
            reach = cone * bounded(-SEEN * slope, LANDED_LEAST, (real)(settings->near));
            landed = outside;
        }
        landed |= is_point(m);
        reach = pick(is_point(m), POINT_REACH * cone * bounded(-LANDED * slope, POINT_LEAST, LANDED_MOST), reach);
        touched &= landed;
    }
    touched &= less(s.near, pick(passed_between(m), LANDED_LEAST * cone, reach));
    real ahead = goal == GOAL_SURFACE ? least(s.near / most(GRAZING_SLOPE, -slope), GRAZING_MOST * cone) : R(0.0);
    ahead = pick(passed_between(m), R(0.0), ahead);
    const mask narrow = goal == GOAL_SURFACE ? bracketed & less_equal(m->high - m->low, (settings->lands ? BRACKETED : SEEN_BRACKETED) * cone) : inside;
    mask failed;
    const mask done = narrow | proof_begin(m, &s, touched, bracketed, m->t + ahead, goal, settings, &failed);
    m->found.hit |= done;
    m->found.last = pick(done, m->low, m->found.last);
    m->found.t = pick(done, pick(touched, least(m->t + ahead, m->high), m->low), m->found.t);
    m->active &= ~done;
    march_onward(m, &s, marching & ~(proof_under_way(m) | failed), overshot, early, passed, slope, goal, settings);
    m->active &= less(m->t, m->r.far) & less(m->found.steps, (real)((scalar)settings->max_steps));
    // A lane that waits for others must not go on proving, or what it finds would depend on them.
    m->proving &= m->active | march_late(m);
}

// The lanes of which something is found act on it; those whose orbits are under way still do nothing yet.
INLINE void march_act_in_time(march *m, sight s, mask late, int goal, march_record settings, orbit_record orbit) {
    if (!CARRIES) {
        march_act(m, s, goal, settings, orbit);
        return;
    }
    m->late = m->active & late;
    m->active &= ~late;
    march_act(m, s, goal, settings, orbit);
    m->active |= m->late;
}

// One step of the active lanes.
INLINE void march_step(march *m, int goal, march_record settings, orbit_record orbit, constants k) {
    sight s = march_place(m);
    mask late = march_late(m);
    s.here = orbit_step(&m->under_way, s.point, m->active, &late, orbit, k, &s.surface);
    march_act_in_time(m, s, late, goal, settings, orbit);
}

#if HAS_DERIVATIVE
// One step of two packets. Their orbits run side by side: an application is a chain of operations that wait for each other, and the
// processor works on the other packet's meanwhile.
INLINE void march_step_both(march *m, march *n, int goal, march_record settings, orbit_record orbit, constants k) {
    sight s = march_place(m), other = march_place(n);
    const vec points[2] = {s.point, other.point};
    const mask active[2] = {m->active, n->active};
    mask late[2] = {march_late(m), march_late(n)};
    clearance found[2];
    orbit_steps(&m->under_way, &n->under_way, points, active, late, found, orbit, k);
    s.here = found[0];
    other.here = found[1];
    march_act_in_time(m, s, late[0], goal, settings, orbit);
    march_act_in_time(n, other, late[1], goal, settings, orbit);
}
#endif
