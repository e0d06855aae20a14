// Entry point of the surface renderer: one work-item renders LANES pixels of a tile, shaded and with all data channels.
//
// A tile is TILE x TILE pixels, its pixels numbered along the Morton curve: any LANES in a row form a compact patch whose
// rays stay together. Film layout: [tile][channel][row][column], TILE x TILE floats a channel; `slots` tells for each channel
// its place among the wanted ones, or -1.

#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "rays.h"
#include "march.h"
#include "shade.h"
#include "sampling.h"

#define TILE_PIXELS (TILE * TILE)

// Even bits of a Morton number, gathered: its column. Its row is the same of the number shifted by one.
INLINE int morton_column(int m) {
    m &= 0x55555555;
    m = (m | (m >> 1)) & 0x33333333;
    m = (m | (m >> 2)) & 0x0f0f0f0f;
    return (m | (m >> 4)) & 0x00ff00ff;
}

INLINE void write_channel(__global float *film, int slot, const int *pixel, real value) {
    if (slot < 0) return;
    scalar each[LANES];
    lanes_store(value, each);
    for (int lane = 0; lane < LANES; ++lane) film[slot * TILE_PIXELS + pixel[lane]] = (float)each[lane];
}

// Everything a sample contributes to the film.
typedef struct {
    color radiance;
    real coverage;
    real depth;
    vec normal, point;
    real smooth, steps;
} sample_result;

__kernel void surface(__global float *film, __global uint *statistics, __global const int2 *corners,
                      __constant const struct View *view, __constant const struct March *settings,
                      __constant const struct Orbit *orbit, __constant const scalar *k,
                      __constant const struct Material *material, __constant const struct Light *lights,
                      __global const float *palette, __constant const int *slots, int channel_count, int first_packet) {
    const int packet = (int)get_global_id(0) + first_packet;
    const int tile = (int)get_global_id(1);
    const int first = packet * LANES;
    const int2 corner = corners[tile];

    // Which pixels: place in the tile, and the part of them that lies in the rendered region.
    int pixel[LANES];
    scalar wanted[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const int column = morton_column(first + lane), row = morton_column((first + lane) >> 1);
        const int x = corner.x + column, y = corner.y + row;
        pixel[lane] = row * TILE + column;
        wanted[lane] = (x >= view->region_left && x < view->region_right && y >= view->region_top && y < view->region_bottom)
                           ? S(1.0) : S(0.0);
    }
    const mask in_region = less(R(0.0), lanes_load(wanted));

    color sum = color_of(R(0.0), R(0.0), R(0.0));
    real coverage = R(0.0), bad = R(0.0), steps = R(0.0), count = R(0.0);
    real nearest_offset = (real)(REAL_LARGEST);
    sample_result kept = {0};
    for (int sample = 0; sample < settings->samples; ++sample) {
        // The ray of each lane's sample.
        scalar x[LANES], y[LANES], offset[LANES];
        for (int lane = 0; lane < LANES; ++lane) {
            const int px = corner.x + pixel[lane] % TILE, py = corner.y + pixel[lane] / TILE;
            scalar across, below;
            sample_offset(px, py, sample, settings->samples, (uint)settings->seed, &across, &below);
            x[lane] = (scalar)px + across;
            y[lane] = (scalar)py + below;
            offset[lane] = (across - S(0.5)) * (across - S(0.5)) + (below - S(0.5)) * (below - S(0.5));
        }
        const real picture_y = lanes_load(y);
        ray leg_ray = camera_ray(lanes_load(x), picture_y, view);
        const ray eye_ray = leg_ray;
        mask leg_active = in_region & ray_clip(&leg_ray, settings->bounds_center, settings->bounds_radius);

        sample_result result;
        mask hit = leg_active & ~leg_active;
        vec start = eye_ray.origin;
        color surface_tint = color_of(R(0.0), R(0.0), R(0.0));
        color radiance = color_mix(color_splat(material->background_top), color_splat(material->background_bottom),
                                   clamp(picture_y / (real)((scalar)view->height), R(0.0), R(1.0)));
        incidence in;
        real cone = R(0.0);
        // Leg 0 is the ray from the eye; each further leg is the shadow ray to one light. One loop, so that the march is
        // compiled once.
        for (int leg = 0; leg <= settings->light_count; ++leg) {
            __constant const struct Light *light = lights + max(leg - 1, 0);
            mask occluded = leg_active & ~leg_active;
            if (leg > 0) {
                if (!any_lane(hit)) break;
                in = light_at(light, start);
                leg_active = hit & less(R(0.0), vec_dot(result.normal, in.toward));
                if (light->shadow == 0) leg_active = leg_active & ~leg_active;
                // Leave the surface far enough for the ray not to meet the very bump it starts from.
                leg_ray.origin = vec_along(start, cone * (real)(settings->shadow_lift), result.normal);
                leg_ray.direction = in.toward;
                leg_ray.near = R(0.0);
                leg_ray.far = in.distance;
                leg_ray.footprint = cone * (real)(settings->shadow_detail);
                leg_ray.spread = R(0.0);
                leg_active &= ray_clip(&leg_ray, settings->bounds_center, settings->bounds_radius);
            }
            if (any_lane(leg_active)) {
                const crossing met = march(leg_ray, leg_active, leg == 0, settings, orbit, k);
                occluded = met.hit;
                count += met.count;
                bad += leg == 0 ? met.bad : R(0.0);
                if (leg == 0) {
                    hit = met.hit;
                    result.steps = met.steps;
                    steps += met.steps;
                    result.depth = met.t;
                } else {
                    steps += met.steps;
                }
            }
            if (leg == 0) {
                if (!any_lane(leg_active)) result.steps = R(0.0);
                if (any_lane(hit)) {
                    // The surface itself: normal from the Jacobian, colour.
                    start = vec_along(eye_ray.origin, result.depth, eye_ray.direction);
                    cone = eye_ray.footprint + eye_ray.spread * result.depth;
                    surface_point surface;
                    const sphere there = orbit_dual_distance(start, hit, orbit, k, &surface);
                    count += pick(hit, there.count, R(0.0));
                    vec normal = vec_normalize(surface.gradient);
                    // No gradient: inside the solid already at the eye, or an extremum. Face the viewer.
                    const mask flat = less(vec_dot(normal, normal), R(0.5)) | there.inside;
                    normal = vec_pick(flat, vec_scale(eye_ray.direction, R(-1.0)), normal);
                    result.normal = normal;
                    result.smooth = smooth_count(there, surface, orbit);
                    surface_tint = surface_color(normal, result.smooth, material, palette);
                    radiance = color_pick(hit, color_of(R(0.0), R(0.0), R(0.0)), radiance);
                }
            } else {
                const color added = phong(surface_tint, result.normal, vec_scale(eye_ray.direction, R(-1.0)), in, ~occluded,
                                          light, material);
                radiance = color_pick(hit, color_of(radiance.r + added.r, radiance.g + added.g, radiance.b + added.b), radiance);
            }
        }

        // With a transparent background what is not hit adds nothing, so that R, G, B come out premultiplied.
        if (material->transparent) radiance = color_pick(hit, radiance, color_of(R(0.0), R(0.0), R(0.0)));
        sum = color_of(sum.r + radiance.r, sum.g + radiance.g, sum.b + radiance.b);
        coverage += pick(hit, R(1.0), R(0.0));

        // Data channels take the sample nearest the pixel's centre, never an average.
        const real sample_distance = lanes_load(offset);
        const mask nearer = less(sample_distance, nearest_offset);
        nearest_offset = pick(nearer, sample_distance, nearest_offset);
        const mask keep = nearer & hit;
        const real along_axis = vec_dot(vec_sub(start, vec_splat(view->eye)), vec_splat(view->axis));
        const vec zero = vec_of(R(0.0), R(0.0), R(0.0));
        kept.depth = pick(nearer, pick(hit, along_axis, (real)(INFINITY)), kept.depth);
        kept.normal = vec_pick(nearer, vec_pick(keep, result.normal, zero), kept.normal);
        kept.point = vec_pick(nearer, vec_pick(keep, start, zero), kept.point);
        kept.smooth = pick(nearer, pick(keep, result.smooth, R(0.0)), kept.smooth);
        kept.steps = pick(nearer, result.steps, kept.steps);
    }

    film += tile * channel_count * TILE_PIXELS;
    const real share = R(1.0) / (real)((scalar)settings->samples);
    write_channel(film, slots[CHANNEL_R], pixel, sum.r * share);
    write_channel(film, slots[CHANNEL_G], pixel, sum.g * share);
    write_channel(film, slots[CHANNEL_B], pixel, sum.b * share);
    write_channel(film, slots[CHANNEL_A], pixel, coverage * share);
    write_channel(film, slots[CHANNEL_Z], pixel, kept.depth);
    write_channel(film, slots[CHANNEL_NX], pixel, kept.normal.x);
    write_channel(film, slots[CHANNEL_NY], pixel, kept.normal.y);
    write_channel(film, slots[CHANNEL_NZ], pixel, kept.normal.z);
    write_channel(film, slots[CHANNEL_PX], pixel, kept.point.x);
    write_channel(film, slots[CHANNEL_PY], pixel, kept.point.y);
    write_channel(film, slots[CHANNEL_PZ], pixel, kept.point.z);
    write_channel(film, slots[CHANNEL_ITERATIONS], pixel, kept.smooth);
    write_channel(film, slots[CHANNEL_STEPS], pixel, kept.steps);

    // Per packet: rays, distance evaluations, formula applications, steps that ended inside.
    statistics += 4 * (tile * (TILE_PIXELS / LANES) + packet);
    statistics[0] = (uint)lanes_sum(pick(in_region, (real)((scalar)settings->samples), R(0.0)));
    statistics[1] = (uint)lanes_sum(steps);
    statistics[2] = (uint)lanes_sum(count);
    statistics[3] = (uint)lanes_sum(bad);
}
