// Surfaces in a grid: the boundary where the value passes `level`.
#include "integrators/volume/volume_sample.h"

INLINE real part_through(real value, world w) { return pick(less((real)(w.settings->level), value), R(0.0), R(1.0)); }

#define HALVINGS 5   // of the step that met the surface

// Steps to the first place above the level, and back to where it is passed.
INLINE mask surface_met(grid_ray g, mask active, world w, real *at, real *looked) {
    mask found = active & ~active;
    real number = R(0.0);
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (!any_lane(active)) break;
        real value, onward;
        const mask seen = look(g, number, &active, w, &value, &onward, looked);
        if (any_lane(seen)) {
            const mask met = seen & less_equal((real)(w.settings->level), value);
            found |= met;
            active &= ~met;
        }
        number = pick(active, onward, number);
    }
    // The crossing lies between this place and the one before.
    real low = most(number - R(1.0), R(0.0)), high = number;
    for (int i = 0; i < TURNS(HALVINGS); ++i) {
        if (!any_lane(found)) break;
        const real middle = R(0.5) * (low + high);
        real value;
        const mask stored = value_met(g, middle, found, w, &value), inside = stored & less_equal((real)(w.settings->level), value);
        high = pick(inside, middle, high);
        low = pick(inside, low, middle);
    }
    *at = high;
    return found;
}

INLINE void sight_grid(sight *e, ray r, grid_ray g, mask active, mask bare, const plane_face *face, mask wanted, world w, real *looked) {
    sight_add(e, face->tint, R(1.0), face->t, face->count, face->normal, bare, bare);
    const vec to_viewer = vec_scale(r.direction, R(-1.0));
    real at;
    const mask found = surface_met(g, active, w, &at, looked);
    if (!any_lane(found)) return;
    const cell c = cell_at(place_of(g, at), w.grid.about);
    const ints entry = brick_at(c, w.grid);
    const mask stored = found & is_stored(entry);
    const real t = distance_of(g, at, w);
    const vec point = vec_along(r.origin, t, r.direction);
    vec normal = grid_normal(c, entry, stored, w.grid);
    const mask none = less(vec_dot(normal, normal), R(0.5));
    // A ray that begins inside, at the grid's side, meets a flat face.
    normal = vec_pick(none, to_viewer, normal_there(point, normal, found & ~none, w));
    const real value = pick(stored, grid_value(c, entry, stored, w.grid), R(0.0));
    const color light = lit(point, normal, tint_of(value, normal, w), to_viewer, found, w, looked);
    sight_add(e, light, R(1.0), t, value, normal, found & ~found, found);
}

INLINE pixel_sample take_sample(const packet_pixels *at, real across, real below, int sample, mask active, world w, counters *cost) {
    real time;
    const ray r = sample_ray(at, across, below, sample, w, &time);
    sight e;
    const pixel_sample s = volume_sample(r, at->y + below, time, active, w, &e, &cost->steps);
    return quads_over(s, r, &e, background_of(at->y + below, w), time, active, w);
}
