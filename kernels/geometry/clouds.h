// Clouds: volumes among the objects that light goes through, along paths. Where they overlap, their extinctions add up, so the first place
// where any of them scatters a path is where it is scattered.
#include "integrators/volume/volume_track.h"

// One of the numbers that the transfer table has for a value.
INLINE real cloud_number(grid_ray r, real value, int column) {
    __global const float *table = r.tables + r.o->transfer;
    const real place = clamp((value - (real)(r.o->value_low)) * (real)(r.o->value_range), R(0.0), R(1.0));
    const real at = place * (real)((scalar)(TRANSFER_SIZE - 1));
    const ints first = min(to_ints(at), (ints)(TRANSFER_SIZE - 2));
    const ints entry = CLOUD_COLUMNS * first + column;
    return between(gather_floats(table, entry), gather_floats(table, entry + CLOUD_COLUMNS), at - to_reals(first));
}

INLINE real bound_at(grid_ray r, real number, mask active, world w, real *until) {
    const grid_cell c = grid_cell_at(grid_place(&r, number + GRID_NUDGE), r.o);
    *until = grid_cell_end(&r, c, active & ~active, number);
    return pick(active, gather_floats(r.tables + r.o->bounds, brick_of(c, r.o)), R(0.0));
}

INLINE mask value_met(grid_ray r, real number, mask active, world w, real *value) {
    *value = grid_value(grid_place(&r, number), r.o, r.tables);
    return active;
}

INLINE real extinction_at(grid_ray r, real value, world w) { return cloud_number(r, value, 0); }

// What shines in clouds is looked for at places of its own (`clouds_shine`).
INLINE int shines_itself(world w) { return 0; }
INLINE color emission_of(real value, world w) { return color_of(R(0.0), R(0.0), R(0.0)); }

// The part of a cloud's box on a ray before `far`; the result says where there is one.
INLINE mask cloud_entered(int number, vec origin, vec direction, real far, world w, grid_ray *r) {
    __global const struct Object *o = w.objects + number;
    const span box = grid_span(o, origin, direction);
    *r = grid_ray_of(o, w.tables, box, origin, direction, far);
    return less(box.entry, box.exit) & less(r->near, r->far);
}

// Where a path is scattered, if that is before it meets anything else.
typedef struct {
    mask met;
    real t, number;      // how far along the ray; and the cloud's number from 1
    real anisotropy;
    color keeps;         // the part of light that is not absorbed
} cloud_place;

// Looks for it on a ray before `far`, for lanes `here`.
CALLED cloud_place clouds_met(const vec *origin, const vec *direction, real far, mask here, stream *numbers, world w) {
    cloud_place found = {here & ~here, far, R(0.0), R(0.0), color_of(R(0.0), R(0.0), R(0.0))};
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (w.objects[i].kind != OBJECT_CLOUD) continue;
        grid_ray r;
        const mask crosses = here & cloud_entered(i, *origin, *direction, found.t, w, &r);
        if (!any_lane(crosses)) continue;
        real number, value, looked = R(0.0);
        color unused = color_of(R(0.0), R(0.0), R(0.0));
        const mask met = track(r, r.end, crosses, numbers, w, &number, &value, &unused, &looked);
        if (!any_lane(met)) continue;
        const color keeps = color_of(fmin(cloud_number(r, value, 1), R(1.0)), fmin(cloud_number(r, value, 2), R(1.0)),
                                     fmin(cloud_number(r, value, 3), R(1.0)));
        found.t = pick(met, fmin(r.near + number * (real)(r.o->voxel), found.t), found.t);
        found.number = pick(met, (real)((scalar)(i + 1)), found.number);
        found.anisotropy = pick(met, (real)(r.o->anisotropy), found.anisotropy);
        found.keeps = color_pick(met, keeps, found.keeps);
        found.met |= met;
    }
    return found;
}

// The part of light that comes through all clouds up to `far`, in the mean.
CALLED real clouds_passed(const vec *origin, const vec *direction, real far, mask here, stream *numbers, world w) {
    real through = R(1.0);
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (w.objects[i].kind != OBJECT_CLOUD) continue;
        grid_ray r;
        real looked = R(0.0);
        const mask crosses = here & less(R(0.0), through) & cloud_entered(i, *origin, *direction, far, w, &r);
        if (any_lane(crosses)) through = pick(crosses, through * track_through(r, r.end, crosses, numbers, w, &looked), through);
    }
    return through;
}

#define SHINING_APART R(2.0)   // sides of a voxel between places where a ray looks for light, at most
#define MOST_SHINING 1024      // such places of a ray in one cloud

// The light that clouds send to the beginning of a ray from its way up to `far`, with nothing dimmed: at places as far apart as each
// other, moved together by a random part of that.
CALLED color clouds_shine(const vec *origin, const vec *direction, real far, mask here, stream *numbers, world w) {
    color sum = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < w.settings->object_count; ++i) {
        if (w.objects[i].kind != OBJECT_CLOUD) continue;
        grid_ray r;
        mask crosses = here & cloud_entered(i, *origin, *direction, far, w, &r);
        if (!any_lane(crosses)) continue;
        const real count = fmin(floor(r.end / SHINING_APART) + R(1.0), (real)(MOST_SHINING)), apart = r.end / count;
        real number = stream_next(numbers, crosses) * apart;
        for (int k = 0; k < MOST_SHINING; ++k) {
            crosses &= less((real)((scalar)k), count);
            if (!any_lane(crosses)) break;
            const real value = grid_value(grid_place(&r, number), r.o, r.tables);
            const color shines = color_of(cloud_number(r, value, 4), cloud_number(r, value, 5), cloud_number(r, value, 6));
            sum = color_pick(crosses, color_add(sum, color_scale(shines, apart)), sum);
            number += apart;
        }
    }
    return sum;
}

// The numbers of a path's ray: where it is scattered on it, what comes through to a light, what shines on it; and all of a walk.
#define CLOUD_WALKS 0x20000000u
#define CLOUD_MEETS 0x40000000u
#define CLOUD_SHADOW_RAY 0x80000000u
#define CLOUD_SHINES 0xc0000000u
INLINE stream cloud_stream(stage s, const packet_pixels *at, uint purpose, world w) {
    return stream_of(at, (uint)w.settings->seed, PURPOSE_FLIGHT + NEXT_BOUNCE * (uint)s.bounce + purpose, s.sample);
}

// Where a path is scattered on its ray before `far`, which then is that place, but past what it has `passed` already; what shines on the
// way there is added.
INLINE cloud_place path_meets_clouds(stage s, const packet_pixels *at, path *so_far, real *far, real passed, mask here, world w) {
    stream numbers = cloud_stream(s, at, CLOUD_MEETS, w);
    const mask open = here & less(passed, *far);
    const real before = pick(open, passed, R(0.0));
    const vec begin = vec_along(so_far->origin, before, so_far->direction);
    cloud_place found = clouds_met(&begin, &so_far->direction, *far - before, open, &numbers, w);
    found.t += before;
    *far = pick(found.met, found.t, *far);
    if (!HAS(w, SHINING_CLOUDS)) return found;
    numbers = cloud_stream(s, at, CLOUD_SHINES, w);
    const color shines = clouds_shine(&so_far->origin, &so_far->direction, *far, here, &numbers, w);
    path_sees(s, so_far, color_mul(shines, so_far->through), here, w);
    return found;
}

// What comes through to a light that was sampled, if its ray has a length.
INLINE real light_passes_clouds(stage s, const packet_pixels *at, ray shadow_ray, mask here, world w) {
    stream numbers = cloud_stream(s, at, CLOUD_SHADOW_RAY, w);
    return clouds_passed(&shadow_ray.origin, &shadow_ray.direction, shadow_ray.far, here & less(R(0.0), shadow_ray.far), &numbers, w);
}

// Brings paths to where clouds have met them.
INLINE void path_in_cloud(path *so_far, const cloud_place *place, mask here) {
    path_flies(so_far, place->t, here);
    so_far->through = color_pick(here, color_mul(so_far->through, place->keeps), so_far->through);
    so_far->on_path = pick(here & ~less(R(0.0), brightest(so_far->through)), R(0.0), so_far->on_path);
}
