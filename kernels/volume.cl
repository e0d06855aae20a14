// Entry point of the volume renderer: one work-item renders LANES pixels of a tile by rays through a grid of voxels.
//
// A ray looks at the grid at places that lie a fixed step apart, counted from where it enters the grid: skipping empty nodes
// leaves out places, and never moves them. SURFACE shows the boundary where the value passes `level`; otherwise places are
// composited from front to back, until the ray is opaque.
#include "lanes.h"
#include "vectors.h"
#include "structs.h"
#include "camera.h"
#include "sampling.h"
#include "shade.h"
#include "tiles.h"
#include "pixel.h"

#if VALUE_IS_FLOAT
typedef float sample;
#else
typedef uchar sample;
#endif
#include "grid.h"

#define HALVINGS 5   // of the step that met the surface

typedef struct {
    __constant const struct View *view;
    __constant const struct Volume *settings;
    __constant const struct Material *material;
    __constant const struct Light *lights;
    __global const float *transfer;   // TRANSFER_SIZE entries: opacity of a step, red, green, blue
    grid grid;
} world;

// A ray in the grid's own measure: voxels from its corner, per scene unit of the ray.
typedef struct {
    vec origin, direction, inverse;
    real near, far;
} grid_ray;

INLINE real safe_inverse(real a) { return R(1.0) / pick(less(fabs(a), R(1e-20)), R(1e-20), a); }

// The part of a ray within the grid; lanes that miss it are not in the result.
INLINE mask enter(ray r, __constant const struct Grid *about, grid_ray *g) {
    const vec scale = vec_splat(about->scale);
    const vec offset = vec_sub(r.origin, vec_splat(about->corner));
    g->origin = vec_of(offset.x * scale.x, offset.y * scale.y, offset.z * scale.z);
    g->direction = vec_of(r.direction.x * scale.x, r.direction.y * scale.y, r.direction.z * scale.z);
    g->inverse = vec_of(safe_inverse(g->direction.x), safe_inverse(g->direction.y), safe_inverse(g->direction.z));
    const vec first = vec_of(-g->origin.x * g->inverse.x, -g->origin.y * g->inverse.y, -g->origin.z * g->inverse.z);
    const vec last = vec_of(((real)((scalar)about->sides[0]) - g->origin.x) * g->inverse.x,
                            ((real)((scalar)about->sides[1]) - g->origin.y) * g->inverse.y,
                            ((real)((scalar)about->sides[2]) - g->origin.z) * g->inverse.z);
    g->near = fmax(fmax(fmin(first.x, last.x), fmin(first.y, last.y)), fmax(fmin(first.z, last.z), r.near));
    g->far = fmin(fmin(fmax(first.x, last.x), fmax(first.y, last.y)), fmin(fmax(first.z, last.z), r.far));
    return less(g->near, g->far);
}

// Where the ray leaves the empty node of 8 << level cells around a cell.
INLINE real leave(grid_ray r, cell c, ints level) {
    const ints shift = level + 3;
    const ints size = (ints)(1) << shift;
    const vec low = vec_of(to_reals((c.x >> shift) << shift), to_reals((c.y >> shift) << shift), to_reals((c.z >> shift) << shift));
    const real side = to_reals(size);
    // Cells begin at the middles of voxels.
    const real x = (low.x + R(0.5) + pick(less(R(0.0), r.direction.x), side, R(0.0)) - r.origin.x) * r.inverse.x;
    const real y = (low.y + R(0.5) + pick(less(R(0.0), r.direction.y), side, R(0.0)) - r.origin.y) * r.inverse.y;
    const real z = (low.z + R(0.5) + pick(less(R(0.0), r.direction.z), side, R(0.0)) - r.origin.z) * r.inverse.z;
    return fmin(x, fmin(y, z));
}

// The number of the first place at or past `t`, but at least the next.
INLINE real next_place(real t, real near, real steps, real number) {
    return fmax(ceil((t - near) * steps), number + R(1.0));
}

// What a value looks like: the opacity of a step, and a colour.
INLINE color transfer_at(real value, __constant const struct Volume *settings, __global const float *transfer, real *opacity) {
    const real place = clamp((value - (real)(settings->low)) * (real)(settings->range), R(0.0), R(1.0));
    const real at = place * (real)((scalar)(TRANSFER_SIZE - 1));
    const ints first = min(to_ints(at), (ints)(TRANSFER_SIZE - 2));
    const real share = at - to_reals(first);
    *opacity = between(gather_floats(transfer, 4 * first), gather_floats(transfer, 4 * first + 4), share);
    return color_of(between(gather_floats(transfer, 4 * first + 1), gather_floats(transfer, 4 * first + 5), share),
                    between(gather_floats(transfer, 4 * first + 2), gather_floats(transfer, 4 * first + 6), share),
                    between(gather_floats(transfer, 4 * first + 3), gather_floats(transfer, 4 * first + 7), share));
}

#if HAS_SHADOWS
// The part of a light that gets through to a point.
INLINE real light_through(vec point, vec normal, vec toward, real distance, mask active, world w, real *steps) {
    __constant const struct Grid *about = w.grid.about;
    ray r;
    r.origin = vec_along(point, (real)(w.settings->shadow_lift), normal);
    r.direction = toward;
    r.near = R(0.0);
    r.far = distance;
    grid_ray g;
    active &= enter(r, about, &g);
    const real step = (real)(w.settings->step), steps_per_unit = R(1.0) / step;
    real number = R(0.0), through = R(1.0);
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (!any_lane(active)) break;
        const real t = g.near + number * step;
        active &= less(t, g.far);
        const cell c = cell_at(vec_along(g.origin, t, g.direction), about);
        const ints entry = brick_at(c, w.grid);
        const mask stored = active & less(R(-0.5), to_reals(entry));
        *steps += pick(active, R(1.0), R(0.0));
        real onward = number + R(1.0);
        if (any_lane(active & ~stored)) {
            onward = pick(stored, onward, next_place(leave(g, c, -1 - entry), g.near, steps_per_unit, number));
        }
        if (any_lane(stored)) {
            const real value = grid_value(c, entry, stored, w.grid);
#if SURFACE
            through = pick(stored & less((real)(w.settings->level), value), R(0.0), through);
#else
            real opacity;
            transfer_at(value, w.settings, w.transfer, &opacity);
            through = pick(stored, through * (R(1.0) - opacity), through);
#endif
            active &= less(R(1.0) - (real)(w.settings->opacity_limit), through);
        }
        number = pick(active, onward, number);
    }
    return through;
}
#endif

// The light that a place of the grid sends to the viewer.
INLINE color lit(vec point, vec normal, color tint, vec to_viewer, mask active, world w, real *steps) {
    color sum = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < w.settings->light_count; ++i) {
        __constant const struct Light *light = w.lights + i;
        const incidence in = light_at(light, point);
        real share = R(1.0);
#if HAS_SHADOWS
        const mask facing = active & less(R(0.0), vec_dot(normal, in.toward));
        if (light->shadow && any_lane(facing)) share = light_through(point, normal, in.toward, in.distance, facing, w, steps);
#endif
        const mask all_lanes = equal(R(0.0), R(0.0));
        const color open = phong(tint, normal, to_viewer, in, all_lanes, R(1.0), light, w.material);
        const color dark = phong(tint, normal, to_viewer, in, ~all_lanes, R(1.0), light, w.material);
        sum = color_add(sum, color_mix(dark, open, share));
    }
    return sum;
}

// A place without a normal faces the viewer, and so does the far side of what is transparent.
INLINE vec facing_normal(vec normal, vec to_viewer) {
    const mask none = less(vec_dot(normal, normal), R(0.5));
    const mask away = less(vec_dot(normal, to_viewer), R(0.0));
    return vec_pick(none, to_viewer, vec_pick(away, vec_scale(normal, R(-1.0)), normal));
}

INLINE shot take_shot(real x, real y, real lens_x, real lens_y, mask wanted, world w, real *steps) {
    __constant const struct Grid *about = w.grid.about;
    const ray r = camera_ray(x, y, lens_x, lens_y, w.view);
    const vec to_viewer = vec_scale(r.direction, R(-1.0));
    grid_ray g;
    mask active = wanted & enter(r, about, &g);
    const real step = (real)(w.settings->step), steps_per_unit = R(1.0) / step;
    const vec zero = vec_of(R(0.0), R(0.0), R(0.0));
    color seen = color_of(R(0.0), R(0.0), R(0.0));
    real through = R(1.0), number = R(0.0), seen_t = R(0.0), seen_value = R(0.0), looked = R(0.0);
    vec seen_normal = zero;
    mask found = active & ~active;
    for (int i = 0; i < w.settings->max_steps; ++i) {
        if (!any_lane(active)) break;
        const real t = g.near + number * step;
        active &= less(t, g.far);
        const cell c = cell_at(vec_along(g.origin, t, g.direction), about);
        const ints entry = brick_at(c, w.grid);
        const mask stored = active & less(R(-0.5), to_reals(entry));
        looked += pick(active, R(1.0), R(0.0));
        real onward = number + R(1.0);
        real value = R(0.0);
        if (any_lane(active & ~stored)) {
            onward = pick(stored, onward, next_place(leave(g, c, -1 - entry), g.near, steps_per_unit, number));
        }
        if (any_lane(stored)) {
            value = grid_value(c, entry, stored, w.grid);
#if SURFACE
            const mask met = stored & less_equal((real)(w.settings->level), value);
            found |= met;
            active &= ~met;
#else
            real opacity;
            const color tint = transfer_at(value, w.settings, w.transfer, &opacity);
            const mask adds = stored & less(R(0.0), opacity);
            if (any_lane(adds)) {
                const vec point = vec_along(r.origin, t, r.direction);
                const vec normal = facing_normal(grid_normal(c, entry, adds, w.grid), to_viewer);
#if COLOR_BY_NORMAL
                const color base = color_of(R(0.5) * normal.x + R(0.5), R(0.5) * normal.y + R(0.5), R(0.5) * normal.z + R(0.5));
#else
                const color base = tint;
#endif
                const real share = through * opacity;
                const color light = lit(point, normal, base, to_viewer, adds, w, &looked);
                seen = color_pick(adds, color_add(seen, color_scale(light, share)), seen);
                through = pick(adds, through * (R(1.0) - opacity), through);
                // Where half of the light is stopped: what the data channels tell.
                const mask half_way = adds & ~found & less_equal(through, R(0.5));
                seen_t = pick(half_way, t, seen_t);
                seen_value = pick(half_way, value, seen_value);
                seen_normal = vec_pick(half_way, normal, seen_normal);
                found |= half_way;
                active &= less(R(1.0) - (real)(w.settings->opacity_limit), through);
            }
#endif
        }
        number = pick(active, onward, number);
    }
#if SURFACE
    // The crossing lies between this place and the one before.
    real low = fmax(g.near, g.near + (number - R(1.0)) * step), high = g.near + number * step;
    cell c;
    ints entry = (ints)(-1);
    for (int i = 0; i < HALVINGS; ++i) {
        if (!any_lane(found)) break;
        const real middle = R(0.5) * (low + high);
        c = cell_at(vec_along(g.origin, middle, g.direction), about);
        entry = brick_at(c, w.grid);
        const mask stored = found & less(R(-0.5), to_reals(entry));
        const real value = pick(stored, grid_value(c, entry, stored, w.grid), R(0.0));
        const mask inside = less_equal((real)(w.settings->level), value);
        high = pick(inside, middle, high);
        low = pick(inside, low, middle);
    }
    seen_t = high;
    if (any_lane(found)) {
        c = cell_at(vec_along(g.origin, seen_t, g.direction), about);
        entry = brick_at(c, w.grid);
        const mask stored = found & less(R(-0.5), to_reals(entry));
        vec normal = grid_normal(c, entry, stored, w.grid);
        const mask none = less(vec_dot(normal, normal), R(0.5));
        // A ray that begins inside, at the grid's side, meets a flat face.
        normal = vec_pick(none, to_viewer, normal);
        const vec point = vec_along(r.origin, seen_t, r.direction);
        real opacity;
        const real value = pick(stored, grid_value(c, entry, stored, w.grid), R(0.0));
        color base = transfer_at(value, w.settings, w.transfer, &opacity);
#if COLOR_BY_NORMAL
        base = color_of(R(0.5) * normal.x + R(0.5), R(0.5) * normal.y + R(0.5), R(0.5) * normal.z + R(0.5));
#endif
        seen = color_pick(found, lit(point, normal, base, to_viewer, found, w, &looked), seen);
        through = pick(found, R(0.0), R(1.0));
        seen_normal = normal;
        seen_value = value;
    }
#endif
    shot s;
    s.coverage = R(1.0) - through;
    s.hit = found;
    color background = color_of(R(0.0), R(0.0), R(0.0));
    if (!w.material->transparent) {
        const real share = clamp(y / (real)((scalar)w.view->height), R(0.0), R(1.0));
        background = color_mix(color_splat(w.material->background_top), color_splat(w.material->background_bottom), share);
    }
    s.radiance = color_add(seen, color_scale(background, through));
    s.point = vec_along(r.origin, seen_t, r.direction);
    s.depth = vec_dot(vec_sub(s.point, vec_splat(w.view->eye)), vec_splat(w.view->axis));
    s.normal = seen_normal;
    s.smooth = seen_value * (real)(w.settings->value_scale) + (real)(w.settings->value_offset);
    s.steps = looked;
    *steps += looked;
    return s;
}

__kernel void volume(__global float *film, __global uint *statistics, __global const int2 *corners,
                     __constant const struct View *view, __constant const struct Volume *settings,
                     __constant const struct Grid *about, __constant const struct Material *material,
                     __constant const struct Light *lights, __global const float *transfer, __global const int *table,
                     __global const sample *values0, __global const sample *values1, __global const sample *values2,
                     __global const sample *values3, __global const uchar *normals0, __global const uchar *normals1,
                     __global const uchar *normals2, __global const uchar *normals3, __constant const int *slots,
                     int channel_count, int first_packet) {
    const int packet = (int)get_global_id(0) + first_packet;
    const int tile = (int)get_global_id(1);
    const world w = {view, settings, material, lights, transfer,
                     {about, table, {values0, values1, values2, values3}, {normals0, normals1, normals2, normals3}}};
    const packet_pixels at = packet_at(packet, corners[tile], view);
    pixel p = pixel_start();
    real steps = R(0.0);
    mask active = at.in_region;
    for (int sample_number = 0; sample_number < settings->samples; ++sample_number) {
        if (!any_lane(active)) break;
        real across = R(0.0), below = R(0.0), lens_x = R(0.0), lens_y = R(0.0);
        const bits index = (bits)((uint)sample_number);
        if (settings->samples > 1) {
            real u, v;
            unit_square(index, pixel_seed(at.columns, at.rows, (uint)settings->seed, PURPOSE_PIXEL), &u, &v);
            filter_offset(u, v, settings->filter, (real)(settings->filter_width), &across, &below);
        }
#if HAS_LENS
        unit_square(index, pixel_seed(at.columns, at.rows, (uint)settings->seed, PURPOSE_LENS), &lens_x, &lens_y);
        unit_disk(lens_x, lens_y, &lens_x, &lens_y);
#endif
        const shot s = take_shot(at.x + across, at.y + below, lens_x, lens_y, active, w, &steps);
        pixel_add(&p, s, active, across * across + below * below);
#if ADAPTIVE
        noise_add(&p, s, active);
        if (sample_number + 1 >= settings->min_samples && (sample_number & 3) == 3) {
            active &= less((real)(settings->noise), noise_of(&p, material->transparent));
        }
#endif
    }
    pixel_write(film + tile * channel_count * TILE_PIXELS, slots, at.place, &p);
    statistics += 4 * (tile * (TILE_PIXELS / LANES) + packet);
    statistics[0] = (uint)lanes_sum(p.shots);
    statistics[1] = (uint)lanes_sum(steps);
    statistics[2] = 0;
    statistics[3] = 0;
}
