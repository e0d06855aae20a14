// Media in a grid: places are composited from front to back, until the ray is opaque.
#include "integrators/volume/volume_sample.h"

INLINE real part_through(real value, world w) { return R(1.0) - opacity_of(value, w); }

// Light is the costly part: places are kept until a lane has PENDING of them, and lit together. One lane has no neighbours to wait
// for, and needs no array.
#define PENDING (LANES == 1 ? 1 : 4)
typedef struct {
    real number, value, weight;
} pending;
typedef struct {
    pending places[PENDING];
    real count, half_number;   // of them; the place where half of the light is stopped
    color sum;                 // the light of those before
} unlit;

INLINE void unlit_add(unlit *u, real number, real value, real weight, mask middle_way, mask adds) {
    for (int k = 0; k < TURNS(PENDING); ++k) {
        const mask here = adds & equal(u->count, (real)((scalar)k));
        u->places[k].number = pick(here, number, u->places[k].number);
        u->places[k].value = pick(here, value, u->places[k].value);
        u->places[k].weight = pick(here, weight, u->places[k].weight);
    }
    u->count += pick(adds, R(1.0), R(0.0));
    u->half_number = pick(middle_way, number, u->half_number);
}

INLINE void unlit_light(unlit *u, sight *e, ray r, grid_ray g, vec to_viewer, world w, real *looked) {
    for (int k = 0; k < TURNS(PENDING); ++k) {
        const mask lit_here = less((real)((scalar)k), u->count);
        if (!any_lane(lit_here)) break;
        const real at = u->places[k].number;
        const cell c = cell_at(place_of(g, at), w.grid.about);
        const vec normal = facing_normal(grid_normal(c, brick_at(c, w.grid), lit_here, w.grid), to_viewer);
        const color light = lit(vec_along(r.origin, distance_of(g, at, w), r.direction), normal,
                                tint_of(u->places[k].value, normal, w), to_viewer, lit_here, w, looked);
        u->sum = color_pick(lit_here, color_add(u->sum, color_scale(light, u->places[k].weight)), u->sum);
        e->normal = vec_pick(lit_here & equal(at, u->half_number), normal, e->normal);
    }
    u->count = R(0.0);
}

// One place further; the lanes through which no light gets any more are active no longer.
INLINE mask sight_step(sight *e, unlit *u, grid_ray g, mask active, real *number, quads *q, world w, real *looked) {
    const real here = *number;
    real value;
    const mask seen = look(g, here, &active, w, &value, number, looked);
    if (!any_lane(seen)) return active;
    const real opacity = opacity_of(value, w), t = distance_of(g, here, w);
    const mask adds = seen & less(R(0.0), opacity);
    if (w.settings->shines) {
        sight_quads(e, t, seen, q, w);
        e->light = color_pick(seen, color_add(e->light, color_scale(emission_of(value, w), e->through)), e->light);
    }
    if (any_lane(adds)) {
        sight_quads(e, t, adds, q, w);
        const real weight = sight_pass(e, opacity, t, value, adds);
        unlit_add(u, here, value, weight, e->middle_way, adds);
        active &= less(R(1.0) - (real)(w.settings->opacity_limit), e->through);
    }
    return active;
}

INLINE void sight_grid(sight *e, ray r, grid_ray g, mask active, mask bare, const plane_face *face, mask wanted, world w, real *looked) {
    const vec to_viewer = vec_scale(r.direction, R(-1.0));
    quads q = quads_ahead(r, wanted, w);
    unlit u = {.half_number = R(-1.0)};
    real number = R(0.0);
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (any_lane(active)) active = sight_step(e, &u, g, active, &number, &q, w, looked);
        if (any_lane(active) && !any_lane(less_equal((real)((scalar)PENDING), u.count))) continue;
        unlit_light(&u, e, r, g, to_viewer, w, looked);
        if (!any_lane(active)) break;
    }
    e->light = color_add(e->light, u.sum);
    sight_quads(e, face->t, bare, &q, w);
    sight_add(e, face->tint, R(1.0), face->t, face->count, face->normal, bare, bare);
    sight_quads(e, (real)(REAL_LARGEST), wanted, &q, w);
}

INLINE pixel_sample take_sample(const packet_pixels *at, real across, real below, int sample, mask active, world w, counters *cost) {
    real time;
    const ray r = sample_ray(at, across, below, sample, w, &time);
    sight e;
    return volume_sample(r, at->y + below, time, active, w, &e, &cost->steps);
}
