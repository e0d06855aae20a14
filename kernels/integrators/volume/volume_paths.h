// Paths through a medium: at each place where light is scattered one light is sampled, and one direction followed (Kajiya 1986), both
// weighed as at surfaces. The colour of the transfer function is the part that is scattered, not absorbed.
#include "shading/phase.h"
#include "integrators/roulette.h"
#include "integrators/volume/volume_bounds.h"
#include "integrators/volume/volume_track.h"
#include "shading/medium_event.h"

// A path while it is followed.
typedef struct {
    vec origin, direction;
    color through, seen;
    real density, total;   // with which its direction was chosen, -1 from the eye; what all lights weighed there
    mask on_path;
} volume_path;

// Where the grid's part of a ray up to `distance` ends, and whether there is one.
INLINE mask into_grid(vec origin, vec direction, real distance, world w, grid_ray *g, real *far) {
    const ray r = {origin, direction, R(0.0), distance, R(0.0), R(0.0), RAY_NOTHING_KNOWN};
    const mask inside = enter(r, w, g);
    *far = (g->far - g->near) / (real)(w.settings->step);
    return inside;
}

INLINE void volume_path_square(const packet_pixels *at, int sample, uint purpose, int bounce, world w, real *u, real *v) {
    unit_square((bits)((uint)sample), pixel_seed(at->columns, at->rows, w.settings->seed, purpose + 16u * (uint)bounce), u, v);
}

// Adds light to what a path has seen; from the second place on no more than the limit.
INLINE void volume_path_adds(volume_path *p, color light, int bounce, mask here, world w) {
    color more = color_mul(light, p->through);
    if (bounce > 0) more = color_limited(more, (real)(w.settings->firefly_limit));
    p->seen = color_pick(here, color_add(p->seen, more), p->seen);
}

// Samples one light, and goes on.
INLINE void volume_path_scatters(volume_path *p, const packet_pixels *at, int sample, int bounce, mask here, stream *random, world w, real *looked) {
    real u, v, choice, roulette;
    volume_path_square(at, sample, PURPOSE_SHADOW_RAY, bounce, w, &u, &v);
    volume_path_square(at, sample, PURPOSE_CHOICE, bounce, w, &choice, &roulette);
    p->total = weight_of_all(p->origin, R(0.0), w);
    const real numbers[LIGHT_SAMPLE_NUMBERS] = {u, v, choice, R(0.5), R(0.5)};
    const medium_event e = {p->direction, (real)(w.settings->anisotropy)};
    const sampled_light a = sample_one_light(p->origin, p->origin, vec_of(R(0.0), R(0.0), R(0.0)), R(0.0), numbers, p->total, w);
    color value;
    real density;
    medium_value(&e, a.ray.toward, &value, &density);
    const color brings = sampled_light_brings(&a, value, density);
    const mask sampled = here & less(R(0.0), brightest(brings));
    grid_ray to_light;
    real far;
    const mask crosses = sampled & ~a.unblocked & into_grid(p->origin, a.ray.toward, a.ray.distance, w, &to_light, &far);
    real comes = R(1.0);
    if (any_lane(crosses)) comes = track_through(to_light, far, crosses, random, w, looked);
    volume_path_adds(p, color_scale(brings, comes), bounce, sampled, w);
    volume_path_square(at, sample, PURPOSE_SCATTER, bounce, w, &u, &v);
    const onward next = medium_sample(&e, u, v);
    p->density = next.density;
    p->direction = vec_pick(here, next.direction, p->direction);
    p->on_path = path_stays(&p->through, roulette, (real)((scalar)bounce), w.settings->roulette, p->on_path);
}

// The first thing that a path from the eye meets.
typedef struct {
    mask found;
    vec point, normal;
    real value;
} first_met;

// Follows paths from the eye; what is past all is left to the picture's own background.
INLINE first_met follow_path(volume_path *p, const packet_pixels *at, real picture_y, int sample, world w, real *looked) {
    stream random = stream_of(at, w.settings->seed, PURPOSE_FLIGHT, sample);
    first_met first = {p->on_path & ~p->on_path, vec_of(R(0.0), R(0.0), R(0.0)), vec_of(R(0.0), R(0.0), R(0.0)), R(0.0)};
    for (int bounce = 0; bounce <= w.settings->bounces + 1; ++bounce) {
        if (!any_lane(p->on_path)) break;
        real light_far = (real)(REAL_LARGEST), far, number, value;
        light_hit before = light_hit_of(p->origin, p->direction, bounce == 0, &light_far, w);
        before.met &= p->on_path;
        grid_ray g;
        const mask crosses = p->on_path & into_grid(p->origin, p->direction, light_far, w, &g, &far);
        color shines = color_of(R(0.0), R(0.0), R(0.0));
        const mask met = track(g, far, crosses, &random, w, &number, &value, &shines, looked);
        if (w.settings->shines) volume_path_adds(p, shines, bounce, crosses, w);
        const mask ends = p->on_path & ~met;
        if (bounce > 0) {
            volume_path_adds(p, light_at_end(p->origin, p->direction, &before, picture_y, p->density, p->total, w), bounce, ends, w);
        } else {
            volume_path_adds(p, before.shows, bounce, ends & before.met, w);
            first.found = met | (before.met & ends);
            first.point = vec_along(p->origin, pick(met, distance_of(g, number, w), light_far), p->direction);
            first.value = pick(met, value, R(0.0));
        }
        p->on_path = met;
        if (!any_lane(met) || bounce > w.settings->bounces) break;
        const cell c = cell_at(place_of(g, number), w.grid.about);
        vec normal = vec_scale(p->direction, R(-1.0));
        if (bounce == 0 || w.material->of_volumes) {
            const ints entry = brick_at(c, w.grid);
            normal = facing_normal(grid_normal(c, entry, met & is_stored(entry), w.grid), normal);
        }
        if (bounce == 0) first.normal = vec_pick(met, normal, vec_scale(p->direction, R(-1.0)));
        const color keeps = tint_of(value, normal, w);
        p->origin = vec_pick(met, vec_along(p->origin, distance_of(g, number, w), p->direction), p->origin);
        p->through = color_pick(met, color_mul(p->through, color_of(fmin(keeps.r, R(1.0)), fmin(keeps.g, R(1.0)), fmin(keeps.b, R(1.0)))),
                                p->through);
        p->on_path &= less(R(0.0), brightest(p->through));
        volume_path_scatters(p, at, sample, bounce, p->on_path, &random, w, looked);
    }
    return first;
}

INLINE pixel_sample take_path(const packet_pixels *at, ray r, real y, real time, int sample, mask wanted, world w, real *steps) {
    const color none = color_of(R(0.0), R(0.0), R(0.0));
    volume_path p = {r.origin, r.direction, color_of(R(1.0), R(1.0), R(1.0)), none, R(-1.0), R(1.0), wanted};
    real looked = R(0.0);
    const first_met first = follow_path(&p, at, y, sample, w, &looked);
    pixel_sample s;
    s.coverage = pick(first.found, R(1.0), R(0.0));
    s.hit = first.found;
    s.radiance = color_add(p.seen, color_pick(first.found, none, sky(r.direction, y, 0, w)));
    s.point = first.point;
    s.depth = depth_of(s.point, time, w.view);
    s.normal = first.normal;
    s.smooth = first.value * (real)(w.settings->value_scale) + (real)(w.settings->value_offset);
    s.steps = looked;
    *steps += looked;
    return s;
}
