// Light is computed where the ray's cone came near the solid: most of these surfaces are rougher than a pixel, and there the
// distance has smoothed them over the pixel's footprint. Where the surface is smooth, light is computed at the hit. It is smooth
// where the gradient at the hit is the one straight above it too. (Before the hit, on the ray, it is that of a place beside it.)
#include "formulas/gathered_orbits.h"

#define LIKE R(0.04)      // radians between these gradients: up to this far apart they are alike ...
#define UNLIKE R(0.08)    // ... and from here on they are not
#define PLACED R(0.01)    // below this, shadows begin at the hit too ...
#define UNPLACED R(0.02)  // ... and from here on at the place before it: rough surfaces shadow themselves
#define ON_BOUNDS R(0.001) // of their radius: so near to them, a ray that begins inside the set is cut by the bounds
#define BESIDE R(0.375)   // radians between the hit's gradient and that before it, up to which they may be of one body ...
#define ASTRAY R(0.5)     // ... and from here on they are not

// How much of something counts that is `a` from what it should be: all below `all`, nothing from `none` on.
INLINE real share_below(vec a, real all, real none) {
    return bounded((none - sqrt(vec_dot(a, a))) / (none - all), R(0.0), R(1.0));
}

#define BEHIND_NEARER R(0.25)   // part of the height behind a wall at which the place is looked for next

// A wall of a hollow is seen from where no distance is known. It has the gradient and the counts of a place behind it, as far as light is
// computed before other surfaces, or nearer where the solid ends before. Where the gradient straight behind it is like that on it, it
// is smooth, and has its own. What is met of anything else keeps what it has.
INLINE void surface_of_walls(ray r, ray_hit *met, mask walls, march_record settings,
                             orbit_record orbit, constants k, surface_point *surface, vec *normal) {
    const vec on_wall = *normal, hit = vec_along(r.origin, met->t, r.direction);
    real height = (real)(settings->near) * (real)(settings->detail) * (r.footprint + r.spread * met->t);
    mask found = walls & ~walls;
    for (int i = 0; i < TURNS(4); ++i) {
        const mask straight = found, asked = i == 3 ? found : walls & ~found;
        if (!any_lane(asked)) continue;
        surface_point behind;
        const vec way = vec_pick(straight, vec_scale(on_wall, R(-1.0)), r.direction);
        const clearance there = orbit_behind(vec_along(hit, height, way), asked, orbit, k, &behind);
        met->more_count += pick(asked, there.end.count, R(0.0));
        const vec gradient = vec_normalize(behind.gradient);
        const mask usable = asked & there.end.inside & less(R(0.5), vec_dot(gradient, gradient));
        const real share = pick(straight & usable, share_below(vec_sub(gradient, on_wall), LIKE, UNLIKE), R(0.0));
        *surface = surface_point_pick(usable & ~straight, behind, *surface);
        *normal = vec_pick(usable & ~straight, gradient, vec_along(*normal, share, vec_sub(on_wall, *normal)));
        found |= usable;
        height *= pick(found, R(1.0), BEHIND_NEARER);
    }
    *normal = vec_pick(walls, vec_normalize(*normal), *normal);
}

// A surface where marches have ended, while the formula is asked for it: up to three times, each time at another `place`.
typedef struct {
    mask asked;
    vec place;
    clearance there;         // what was found where it is seen, before it
    surface_point surface;
    vec wide, at_hit;        // the gradient there, and that at the hit
    vec normal;
} lit;

INLINE void lit_begin(lit *l, ray r, const ray_hit *met, mask active) {
    l->asked = active;
    l->place = vec_along(r.origin, met->touch, r.direction);
}

// What has been found there tells where it is asked next, `turn` by turn.
INLINE void lit_found(lit *l, int turn, clearance here, surface_point found, ray r, ray_hit *met, march_record settings) {
    met->more_count += pick(l->asked, here.end.count, R(0.0));
    const vec gradient = vec_normalize(found.gradient);
    if (turn == 0) {
        l->there = here;
        l->surface = found;
        l->wide = l->normal = gradient;
        l->asked &= ~is_blind(here);
        // The search by steps has no place before the hit.
        l->asked &= less(met->touch, met->last) | less(met->touch, met->t);
        l->place = vec_along(r.origin, met->last, r.direction);
    } else if (turn == 1) {
        const real cone = (real)(settings->detail) * (r.footprint + r.spread * met->t);
        const real way = most(R(0.01) * cone, met->last - met->touch);
        l->at_hit = vec_normalize(vec_along(gradient, (met->t - met->last) / way, vec_sub(gradient, l->wide)));
        l->asked &= less(R(0.0), share_below(vec_sub(l->at_hit, l->wide), BESIDE, ASTRAY));
        const real height = (met->touch - met->t) * vec_dot(l->wide, r.direction);
        l->place = vec_along(vec_along(r.origin, met->t, r.direction), most(R(0.0), height), l->wide);
    } else {
        l->asked &= ~here.end.inside & less(R(0.5), vec_dot(gradient, gradient));
        const vec apart = vec_sub(gradient, l->at_hit), turned = vec_sub(l->at_hit, l->wide);
        const real share = share_below(apart, LIKE, UNLIKE) * share_below(turned, BESIDE, ASTRAY);
        l->normal = vec_pick(l->asked, vec_normalize(vec_along(l->wide, share, turned)), l->wide);
        met->touch += pick(l->asked, share_below(apart, PLACED, UNPLACED) * (met->t - met->touch), R(0.0));
    }
}

// How often the formula is asked for each surface.
INLINE int lit_turns(march_record settings) { return settings->lands ? 3 : 1; }

// The surface where a march has ended: how far it is before it, at `touch`, and its normal, which may be that at the hit.
INLINE surface_point surface_lit(ray r, ray_hit *met, mask active, march_record settings,
                                 orbit_record orbit, constants k, clearance *there, vec *normal) {
    lit l;
    lit_begin(&l, r, met, active);
    for (int i = 0; i < TURNS(3); ++i) {
        if (i >= lit_turns(settings) || !any_lane(l.asked)) break;
        surface_point found;
        const clearance here = orbit_dual_distance(l.place, l.asked, OF_SURFACE, orbit, k, &found);
        lit_found(&l, i, here, found, r, met, settings);
    }
    *there = l.there;
    *normal = l.normal;
    return l.surface;
}

#define POLISH_HEIGHT R(0.16667)
// A place that does not depend on how the march came there: where the distance is a sixth of the cone, by the secant method (the
// slope is that of a distance, -1, at first). Normals from the positions of points need it.
INLINE surface_point surface_polished(ray r, ray_hit *met, mask active, march_record settings,
                                      orbit_record orbit, constants k, clearance *there) {
    surface_point surface;
    const real cone = (real)(settings->detail) * (r.footprint + r.spread * met->t);
    const real wanted = POLISH_HEIGHT * cone;
    real t = met->touch, before = t, height_before = R(0.0);
    mask moves = active;
    for (int i = 0; i < settings->polish; ++i) {
        *there = orbit_dual_distance(vec_along(r.origin, t, r.direction), active, OF_SURFACE, orbit, k, &surface);
        met->more_count += pick(active, there->end.count, R(0.0));
        met->more_steps += pick(active, R(1.0), R(0.0));
        if (i == settings->polish - 1) break;
        // What the bounds have cut is where the ray begins, and a wall of a hollow where its bracket is.
        if (i == 0) moves &= ~there->end.inside;
        const real height = pick(is_blind(*there), R(0.0), there->step * step_scale_of(*there, settings->step_scale) - wanted);
        const real slope = (height - height_before) / (t - before);
        const mask usable = less(slope, R(0.0)) & less(R(-1e6), slope);
        const real move = i == 0 ? height : pick(usable, -height / slope, height);
        before = t;
        height_before = height;
        t += pick(moves, bounded(move, -cone, cone), R(0.0));
    }
    met->touch = pick(active, t, met->touch);
    met->t = pick(active, t, met->t);
    return surface;
}

// Where a surface is looked at begins: what is not known of it yet.
INLINE void surface_begin(ray_hit *met) {
    met->touch = least(met->touch, met->last);
    met->more_steps = met->more_count = R(0.0);
}

// What is kept of a surface whose gradient is `normal`, before which `there` was found.
INLINE void surface_end(ray r, ray_hit *met, clearance there, surface_point surface, vec normal, march_record settings, orbit_record orbit) {
    // No gradient: inside the solid already where the ray begins, or an extremum. What the bounds cut has their normal; else face
    // the viewer.
    const mask flat = less(vec_dot(normal, normal), R(0.5)) | there.end.inside;
    const vec arm = vec_sub(vec_along(r.origin, met->touch, r.direction), vec_splat(settings->bounds_center));
    const real radius = (real)(settings->bounds_radius), nearly = (R(1.0) - ON_BOUNDS) * radius;
    const mask cut = there.end.inside & less(nearly * nearly, vec_dot(arm, arm)) & less(vec_dot(arm, r.direction), R(0.0));
    normal = vec_pick(flat, vec_pick(cut, vec_scale(arm, R(1.0) / radius), vec_scale(r.direction, R(-1.0))), normal);
    // What is seen does not face away, but for a pixel's width past a rim. A hit on the far side of a sheet thinner than a pixel
    // does: mirrored, it stands for the near side.
    const real away = vec_dot(normal, r.direction);
    met->normal = vec_pick(less(R(0.1), away), vec_along(normal, R(-2.0) * away, r.direction), normal);
    met->smooth = smooth_count(there.end, surface, orbit);
    if (!JOINED) return;
    met->solid = surface.own.solid;
    met->other = surface.other.solid;
    met->part = surface.share;
}

// The surface where a march has ended: its normal and its escape count. `touch` becomes the place that is shaded. `polished`: where
// exactly it is may matter.
INLINE void surface_at(ray r, ray_hit *met, mask active, int polished, march_record settings, orbit_record orbit, constants k) {
    surface_begin(met);
    clearance there;
    vec normal;
    surface_point surface;
    if (polished && settings->polish) {
        surface = surface_polished(r, met, active, settings, orbit, k, &there);
        normal = vec_normalize(surface.gradient);
    } else {
        surface = surface_lit(r, met, active, settings, orbit, k, &there, &normal);
    }
    if (JOINED) surface_of_walls(r, met, active & is_blind(there), settings, orbit, k, &surface, &normal);
    surface_end(r, met, there, surface, normal, settings, orbit);
}

// Looks at the surfaces that the rays of a queue from number `at` on have met: normals and escape counts, and where exactly
// they are, if that matters.
INLINE void look_at(queue q, int at, march_record settings, orbit_record orbit, constants k) {
    ray_hit e = queue_met(q, 0, at);
    const mask hit = mask_of(e.hit);
    if (!any_lane(hit)) return;
    surface_at(queue_ray(q, 0, at), &e, hit, q.known, settings, orbit, k);
    ray_hit_keep_surface(q, at, &e);
}

#if CARRIES
// The same of several packets, whose orbits are gathered. The result is where the next ones begin.
INLINE int look_at_several(queue q, share mine, march_record settings, orbit_record orbit, constants k) {
    gathered all;
    lit l[GATHERED];
    ray_hit met[GATHERED];
    int places[GATHERED], count = 0, at = mine.next;
    for (; at < mine.end && count < GATHERED; at += LANES) {
        ray_hit e = queue_met(q, 0, at);
        const mask hit = mask_of(e.hit);
        if (!any_lane(hit)) continue;
        surface_begin(&e);
        lit_begin(l + count, queue_ray(q, 0, at), &e, hit);
        gathered_ask(&all, count, hit, l[count].place);
        met[count] = e;
        places[count++] = at;
    }
    for (int turn = 0; count > 0 && turn < lit_turns(settings); ++turn) {
        gathered_run(&all, count, orbit, k);
        for (int i = 0; i < count; ++i) {
            surface_point found;
            clearance here = {R(0.0)};
            here.end = gathered_surface(&all, i, &found);
            lit_found(l + i, turn, here, found, queue_ray(q, 0, places[i]), met + i, settings);
            gathered_ask(&all, i, l[i].asked, l[i].place);
        }
    }
    for (int i = 0; i < count; ++i) {
        surface_end(queue_ray(q, 0, places[i]), met + i, l[i].there, l[i].surface, l[i].normal, settings, orbit);
        ray_hit_keep_surface(q, places[i], met + i);
    }
    return at;
}
#endif

// Looks at the surfaces of a share that was marched. A single lane looks in a kernel of its own, which leaves it more registers for
// the march.
INLINE void look_at_share(share mine, queue q, int goal, march_record settings, orbit_record orbit, constants k) {
    if (LANES == 1 || (goal != GOAL_SURFACE && goal != GOAL_POINT)) return;
#if CARRIES
    if (!(q.known && settings->polish)) {
        while (mine.next < mine.end) mine.next = look_at_several(q, mine, settings, orbit, k);
        return;
    }
#endif
    for (int at = mine.next; at < mine.end; at += LANES) look_at(q, at, settings, orbit, k);
}
