// A pass over a packet's pixels, the same for every renderer: adds samples `first` to `end` to the results of earlier passes.
//
// The sums of a pixel are kept on the device between passes, unchanged, so that a picture has the same bits
// however its samples are split.

#include "integrators/arguments.h"

// A launch: tiles, a part of their packets, and a part of their samples.
typedef struct {
    __global float *framebuffer;           // see `pixel_write`
    __global scalar *kept;          // [tile][number of a pixel][packet][lane]
    __global uint *statistics;      // [tile of the launch][packet][STATISTICS]
    __global const int4 *places;    // of each tile: its top left pixel, x and y; its number in `kept`
    view_record view;
    __constant const struct Sampling *sampling;
    __global const int *slots;      // places of channels in the framebuffer, then of a pixel's numbers in `kept`; -1: not wanted
    int channel_count, kept_count;
    int first_packet, end_packet;
    int first, end;                 // samples
    int mode;                       // PASS_KEEP, PASS_ADD or both
} pass;

// A number of a packet's pixels, loaded from the kept data or stored there.
INLINE void kept_number(__global scalar *kept, __global const int *slots, int number, int write, real *value) {
    if (slots[number] < 0) return;
    __global scalar *at = kept + slots[number] * TILE_PIXELS;
    if (write) lanes_store(*value, at);
    else *value = lanes_load(at);
}

// All numbers of a struct, from the kept number `first` on: KEPT numbers them in the order of `pixel`, `parts` and `cryptomatte`.
#define KEPT_NUMBER(i) kept_number(kept, slots, first + i, write, numbers + i);
#define KEPT_NUMBERS(name, type, begins)                                                                                   \
    INLINE void name(__global scalar *kept, __global const int *slots, int write, type *sums) {                            \
        real *numbers = (real *)sums;                                                                                      \
        const int first = begins;                                                                                          \
        FOR_NUMBERS(NUMBERS_OF(type), KEPT_NUMBER)                                                                         \
    }
KEPT_NUMBERS(kept_pixel, pixel, 0)
KEPT_NUMBERS(kept_parts, parts, NUMBERS_OF(pixel))
KEPT_NUMBERS(kept_cryptomatte, cryptomatte, KEPT_CRYPTOMATTE_0)

// A packet of a launch: which one, its pixels, and where its kept data and its statistics begin.
typedef struct {
    int tile, packet;
    packet_pixels at;
    __global scalar *kept;
    __global uint *sums;
} place_in_pass;

INLINE place_in_pass place_of_packet(pass s, int packet, int tile) {
    const int4 corner = s.places[tile];
    return (place_in_pass){tile, packet, packet_at(packet, (int2)(corner.x, corner.y), s.view),
                                s.kept + corner.z * s.kept_count * TILE_PIXELS + packet * LANES,
                                s.statistics + STATISTICS * (tile * (TILE_PIXELS / LANES) + packet)};
}

// What the packet's pixels had before this pass.
INLINE pixel pixel_before(pass s, const place_in_pass *here) {
    pixel p = pixel_start();
    if (s.first > 0) kept_pixel(here->kept, s.slots + CHANNEL_COUNT, 0, &p);
    return p;
}

// The pixels that take this sample: one that is done has fewer samples, and one that has more got them before this pass was
// interrupted.
INLINE mask sample_wanted(pass s, const packet_pixels *at, const pixel *p, int sample) {
    mask active = at->in_region & equal(p->samples, (real)((scalar)sample));
    // Lane by lane: a pixel's samples must not depend on its neighbours in the packet.
    if (s.sampling->adaptive && sample > 0 && sample >= s.sampling->min_samples && (sample & 3) == 0) {
        active &= less((real)(s.sampling->noise), noise_of(p, s.sampling->transparent));
    }
    return active;
}

// Where in its pixel a sample lies, pixels from the middle. One sample lies in the middle.
INLINE void sample_offset(pass s, const packet_pixels *at, int sample, real *across, real *below) {
    *across = *below = R(0.0);
    if (s.sampling->samples <= 1) return;
    real u, v;
    unit_square((bits)((uint)sample), pixel_seed(at->columns, at->rows, (uint)s.sampling->seed, PURPOSE_PIXEL), &u, &v);
    filter_offset(u, v, s.sampling->filter, (real)(s.sampling->filter_width), across, below);
}

// Where a sample goes through the lens, lens radii from its middle, and when.
INLINE void sample_of_lens(const packet_pixels *at, int sample, uint seed, view_record view, real *lens_x, real *lens_y, real *time) {
    *lens_x = *lens_y = *time = R(0.0);
    if (view->has_lens) {
        unit_square((bits)((uint)sample), pixel_seed(at->columns, at->rows, seed, PURPOSE_LENS), lens_x, lens_y);
        unit_disk(*lens_x, *lens_y, lens_x, lens_y);
    }
    if (view->spans > 0) *time = shutter_time(at->columns, at->rows, seed, sample);
}

// Adds one sample to the sums of the packet's pixels; `offset`: its distance squared from the middle, pixels.
INLINE void sample_add(pass s, pixel *p, pixel_sample found, mask active, real offset) {
    pixel_add(p, found, active, offset);
    if (s.sampling->adaptive) noise_add(p, found, active);
}

// Writes what the pixels have so far: means to the framebuffer, and sums for a later pass.
INLINE void pass_write(pass s, const place_in_pass *here, pixel *p) {
    pixel_write(s.framebuffer + here->tile * s.channel_count * TILE_PIXELS, s.slots, here->at.place, p);
    if (s.mode & PASS_KEEP) kept_pixel(here->kept, s.slots + CHANNEL_COUNT, 1, p);
}

// Sets the counts to which marches add the lanes that wait: once in a launch, unless it continues the one before.
INLINE void count_waits_from(pass s, const place_in_pass *here) {
    if (!(s.mode & PASS_ADD)) here->sums[STATISTIC_WAITS] = here->sums[STATISTIC_ORBIT_WAITS] = 0u;
}

// Counts what the launch has done for the packet, or adds to what was counted.
INLINE void pass_count(const place_in_pass *here, int add, real samples, real hits, counters cost) {
    const real counts[STATISTIC_WAITS] = {samples, hits, cost.steps, cost.count, cost.bad};
#define ADD_COUNT(i) here->sums[i] = (add ? here->sums[i] : 0u) + (uint)lanes_sum(counts[i]);
    FOR_NUMBERS(STATISTIC_WAITS, ADD_COUNT)
}
