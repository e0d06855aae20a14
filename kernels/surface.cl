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
#if SEARCH == SEARCH_STEPS
#include "march_steps.h"
#else
#include "march.h"
#endif
#include "batch.h"
#include "sampling.h"
#include "shade.h"
#include "normals.h"
#include "coloring.h"
#if HAS_ENVIRONMENT
#include "environment.h"
#endif
#include "spot.h"
#include "pixel_points.h"
#include "secondary.h"
#include "shot.h"

#define TILE_PIXELS (TILE * TILE)

// Even bits of a Morton number, gathered: its column. Its row is the same of the number shifted by one.
INLINE int morton_column(int m) {
    m &= 0x55555555;
    m = (m | (m >> 1)) & 0x33333333;
    m = (m | (m >> 2)) & 0x0f0f0f0f;
    return (m | (m >> 4)) & 0x00ff00ff;
}

INLINE void write_channel(__global float *film, int slot, const int *place, real value) {
    if (slot < 0) return;
    scalar each[LANES];
    lanes_store(value, each);
    for (int lane = 0; lane < LANES; ++lane) film[slot * TILE_PIXELS + place[lane]] = (float)each[lane];
}

// Sums over the shots of a pixel, and what the one nearest to its middle found.
typedef struct {
    color radiance;
    real coverage, shots;
    real brightness, brightness_square;   // of each shot, for its noise
    real coverage_square;
    real nearest;                         // distance squared of the kept shot from the middle, pixels
    real depth;
    vec normal, point;
    real smooth, steps;
} pixel;

INLINE void pixel_add(pixel *p, shot s, mask active, real offset) {
    const real one = pick(active, R(1.0), R(0.0));
    p->radiance = color_pick(active, color_add(p->radiance, s.radiance), p->radiance);
    p->coverage += pick(active, s.coverage, R(0.0));
    p->shots += one;
    // Data channels take the sample nearest the pixel's centre, never an average.
    const mask nearer = active & less(offset, p->nearest);
    const vec zero = vec_of(R(0.0), R(0.0), R(0.0));
    p->nearest = pick(nearer, offset, p->nearest);
    p->depth = pick(nearer, pick(s.hit, s.depth, (real)(INFINITY)), p->depth);
    p->normal = vec_pick(nearer, vec_pick(s.hit, s.normal, zero), p->normal);
    p->point = vec_pick(nearer, vec_pick(s.hit, s.point, zero), p->point);
    p->smooth = pick(nearer, pick(s.hit, s.smooth, R(0.0)), p->smooth);
    p->steps = pick(nearer, s.steps, p->steps);
}

#if ADAPTIVE
// Adds a shot to what tells a pixel's noise: brightness as the eye sees it, the square root of luminance, and coverage.
INLINE void noise_add(pixel *p, shot s, mask active) {
    const real luminance = R(0.2126) * s.radiance.r + R(0.7152) * s.radiance.g + R(0.0722) * s.radiance.b;
    const real seen = pick(active, sqrt(fmax(luminance, R(0.0))), R(0.0));
    p->brightness += seen;
    p->brightness_square += seen * seen;
    p->coverage_square += pick(active, s.coverage * s.coverage, R(0.0));
}

// The standard error of a pixel's mean: of its brightness, or of its coverage if that is larger and is seen.
INLINE real noise_of(const pixel *p, int transparent) {
    const real share = R(1.0) / p->shots;
    const real mean = p->brightness * share, coverage = p->coverage * share;
    const real of_coverage = transparent ? p->coverage_square * share - coverage * coverage : R(0.0);
    const real variance = fmax(p->brightness_square * share - mean * mean, of_coverage);
    return sqrt(fmax(variance, R(0.0)) / fmax(p->shots - R(1.0), R(1.0)));
}
#endif

__kernel void surface(__global float *film, __global uint *statistics, __global const int2 *corners,
                      __constant const struct View *view, __constant const struct March *settings,
                      __constant const struct Orbit *orbit, __constant const scalar *k,
                      __constant const struct Material *material, __constant const struct Light *lights,
                      __global const float *palette, __global const float *environment, __constant const int *slots,
                      int channel_count, int first_packet) {
    const int packet = (int)get_global_id(0) + first_packet;
    const int tile = (int)get_global_id(1);
    const int first = packet * LANES;
    const int2 corner = corners[tile];
    const world w = {view, settings, orbit, k, material, lights, palette, environment};

    // Which pixels: place in the tile and in the picture, and the part of them that lies in the rendered region.
    int place[LANES], columns[LANES], rows[LANES];
    scalar wanted[LANES], x[LANES], y[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const int column = morton_column(first + lane), row = morton_column((first + lane) >> 1);
        columns[lane] = corner.x + column;
        rows[lane] = corner.y + row;
        place[lane] = row * TILE + column;
        x[lane] = (scalar)columns[lane] + S(0.5);
        y[lane] = (scalar)rows[lane] + S(0.5);
        wanted[lane] = (columns[lane] >= view->region_left && columns[lane] < view->region_right &&
                        rows[lane] >= view->region_top && rows[lane] < view->region_bottom)
                           ? S(1.0) : S(0.0);
    }
    const mask in_region = less(R(0.0), lanes_load(wanted));
    const real middle_x = lanes_load(x), middle_y = lanes_load(y);

    pixel p = {0};
    p.nearest = (real)(REAL_LARGEST);
    tally cost = {R(0.0), R(0.0), R(0.0)};
    mask active = in_region;
    for (int sample = 0; sample < settings->samples; ++sample) {
        if (!any_lane(active)) break;
        // One sample lies in the middle.
        real across = R(0.0), below = R(0.0);
        if (settings->samples > 1) {
            real u, v;
            unit_square((bits)((uint)sample), pixel_seed(columns, rows, (uint)settings->seed, PURPOSE_PIXEL), &u, &v);
            filter_offset(u, v, settings->filter, (real)(settings->filter_width), &across, &below);
        }
        const shot s = take_shot(middle_x + across, middle_y + below, sample, columns, rows, active, w, &cost);
        pixel_add(&p, s, active, across * across + below * below);
#if ADAPTIVE
        noise_add(&p, s, active);
        // Lane by lane: a pixel's samples must not depend on its neighbours in the packet.
        if (sample + 1 >= settings->min_samples && (sample & 3) == 3) {
            active &= less((real)(settings->noise), noise_of(&p, material->transparent));
        }
#endif
    }

    film += tile * channel_count * TILE_PIXELS;
    const real share = R(1.0) / fmax(p.shots, R(1.0));
    write_channel(film, slots[CHANNEL_R], place, p.radiance.r * share);
    write_channel(film, slots[CHANNEL_G], place, p.radiance.g * share);
    write_channel(film, slots[CHANNEL_B], place, p.radiance.b * share);
    write_channel(film, slots[CHANNEL_A], place, p.coverage * share);
    write_channel(film, slots[CHANNEL_Z], place, p.depth);
    write_channel(film, slots[CHANNEL_NX], place, p.normal.x);
    write_channel(film, slots[CHANNEL_NY], place, p.normal.y);
    write_channel(film, slots[CHANNEL_NZ], place, p.normal.z);
    write_channel(film, slots[CHANNEL_PX], place, p.point.x);
    write_channel(film, slots[CHANNEL_PY], place, p.point.y);
    write_channel(film, slots[CHANNEL_PZ], place, p.point.z);
    write_channel(film, slots[CHANNEL_ITERATIONS], place, p.smooth);
    write_channel(film, slots[CHANNEL_STEPS], place, p.steps);
    write_channel(film, slots[CHANNEL_SAMPLES], place, p.shots);

    // Per packet: rays, distance evaluations, formula applications, steps that ended inside.
    statistics += 4 * (tile * (TILE_PIXELS / LANES) + packet);
    statistics[0] = (uint)lanes_sum(p.shots);
    statistics[1] = (uint)lanes_sum(cost.steps);
    statistics[2] = (uint)lanes_sum(cost.count);
    statistics[3] = (uint)lanes_sum(cost.bad);
}
