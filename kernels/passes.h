// A pass over a packet's pixels, the same for every renderer: adds samples `first` to `end` to the results of earlier passes.
//
// The sums of a pixel are kept on the device between passes, unchanged, so that a picture has the same bits
// however its samples are split. A renderer defines before this file: `world`, what its shots read, and
//   shot sample_shot(const packet_pixels *at, real across, real below, int sample, mask active, world w, tally *cost)
// which takes one shot at (across, below), in pixels from each pixel's middle.

// The first and the last arguments of a renderer's kernel; its own stand between them. OpenCL 1.2 guarantees eight `__constant` ones:
// lists are `__global`, and constant what all work-items read at the same time.
#define PASS_BUFFERS                                                                                                       \
    __global float *film, __global scalar *kept, __global uint *statistics, __global const int4 *places,                   \
        __constant const struct View *view, __constant const struct Sampling *sampling
#define PASS_SPAN                                                                                                          \
    __global const int *slots, int channel_count, int kept_count, int first_packet, int end_packet, int first, int end, \
        int mode
#define PASS {film, kept, statistics, places, view, sampling, slots, channel_count, kept_count, first_packet, end_packet, first, end, mode}

// A launch: tiles, a part of their packets, and a part of their samples.
typedef struct {
    __global float *film;           // see `pixel_write`
    __global scalar *kept;          // [tile][number of a pixel][packet][lane]
    __global uint *statistics;      // [tile of the launch][packet][STATISTICS]
    __global const int4 *places;    // of each tile: its top left pixel, x and y; its number in `kept`
    __constant const struct View *view;
    __constant const struct Sampling *sampling;
    __global const int *slots;      // places of channels in the film, then of a pixel's numbers in `kept`; -1: not wanted
    int channel_count, kept_count;
    int first_packet, end_packet;
    int first, end;                 // samples
    int mode;                       // PASS_KEEP, PASS_ADD or both
} pass;

// A number of a packet's pixels, loaded from the kept data or stored there.
INLINE void kept_number(__global scalar *kept, __global const int *slots, int number, int write, real *value) {
    if (slots[number] < 0) return;
    __global scalar *at = kept + slots[number] * TILE_PIXELS;
    scalar each[LANES];
    if (write) {
        lanes_store(*value, each);
        for (int lane = 0; lane < LANES; ++lane) at[lane] = each[lane];
    } else {
        for (int lane = 0; lane < LANES; ++lane) each[lane] = at[lane];
        *value = lanes_load(each);
    }
}

INLINE void kept_pixel(__global scalar *kept, __global const int *slots, int write, pixel *p) {
    kept_number(kept, slots, KEPT_RED, write, &p->radiance.r);
    kept_number(kept, slots, KEPT_GREEN, write, &p->radiance.g);
    kept_number(kept, slots, KEPT_BLUE, write, &p->radiance.b);
    kept_number(kept, slots, KEPT_COVERAGE, write, &p->coverage);
    kept_number(kept, slots, KEPT_SHOTS, write, &p->shots);
#if ADAPTIVE
    kept_number(kept, slots, KEPT_BRIGHTNESS, write, &p->brightness);
    kept_number(kept, slots, KEPT_BRIGHTNESS_SQUARE, write, &p->brightness_square);
    kept_number(kept, slots, KEPT_COVERAGE_SQUARE, write, &p->coverage_square);
#endif
    kept_number(kept, slots, KEPT_NEAREST, write, &p->nearest);
    kept_number(kept, slots, KEPT_DEPTH, write, &p->depth);
    kept_number(kept, slots, KEPT_NORMAL_X, write, &p->normal.x);
    kept_number(kept, slots, KEPT_NORMAL_Y, write, &p->normal.y);
    kept_number(kept, slots, KEPT_NORMAL_Z, write, &p->normal.z);
    kept_number(kept, slots, KEPT_POINT_X, write, &p->point.x);
    kept_number(kept, slots, KEPT_POINT_Y, write, &p->point.y);
    kept_number(kept, slots, KEPT_POINT_Z, write, &p->point.z);
    kept_number(kept, slots, KEPT_SMOOTH, write, &p->smooth);
    kept_number(kept, slots, KEPT_STEPS, write, &p->steps);
}

// One work-item's part of a pass: LANES pixels of a tile.
INLINE void render_packet(pass s, world w) {
    const int packet = (int)get_global_id(0) + s.first_packet, tile = (int)get_global_id(1);
    if (packet >= s.end_packet) return;
    const int4 place = s.places[tile];
    const packet_pixels at = packet_at(packet, (int2)(place.x, place.y), s.view);
    __global scalar *kept = s.kept + place.z * s.kept_count * TILE_PIXELS + packet * LANES;
    __global const int *kept_slots = s.slots + CHANNEL_COUNT;
    pixel p = pixel_start();
    if (s.first > 0) kept_pixel(kept, kept_slots, 0, &p);
    const real shots_before = p.shots;
    real hits = R(0.0);
    tally cost = {R(0.0), R(0.0), R(0.0)};
    for (int sample = s.first; sample < s.end; ++sample) {
        // A pixel that is done has fewer shots. One that has more got them before this pass was interrupted.
        mask active = at.in_region & ~less(p.shots, (real)((scalar)sample));
        if (!any_lane(active)) break;
        active &= equal(p.shots, (real)((scalar)sample));
#if ADAPTIVE
        // Lane by lane: a pixel's samples must not depend on its neighbours in the packet.
        if (sample > 0 && sample >= s.sampling->min_samples && (sample & 3) == 0) {
            active &= less((real)(s.sampling->noise), noise_of(&p, s.sampling->transparent));
        }
#endif
        if (*(volatile __constant const int *)&s.sampling->cancelled) return;
        if (!any_lane(active)) continue;
        // One sample lies in the middle.
        real across = R(0.0), below = R(0.0);
        if (s.sampling->samples > 1) {
            real u, v;
            unit_square((bits)((uint)sample), pixel_seed(at.columns, at.rows, (uint)s.sampling->seed, PURPOSE_PIXEL), &u, &v);
            filter_offset(u, v, s.sampling->filter, (real)(s.sampling->filter_width), &across, &below);
        }
        const shot found = sample_shot(&at, across, below, sample, active, w, &cost);
        pixel_add(&p, found, active, across * across + below * below);
        hits += pick(active & less(R(0.0), found.coverage), R(1.0), R(0.0));
#if ADAPTIVE
        noise_add(&p, found, active);
#endif
    }
    // A shot that was told to end is worth nothing: what the packet had before stays.
    if (*(volatile __constant const int *)&s.sampling->cancelled) return;
    pixel_write(s.film + tile * s.channel_count * TILE_PIXELS, s.slots, at.place, &p);
    if (s.mode & PASS_KEEP) kept_pixel(kept, kept_slots, 1, &p);

    __global uint *sums = s.statistics + STATISTICS * (tile * (TILE_PIXELS / LANES) + packet);
    const int add = s.mode & PASS_ADD;
    sums[STATISTIC_RAYS] = (add ? sums[STATISTIC_RAYS] : 0u) + (uint)lanes_sum(p.shots - shots_before);
    sums[STATISTIC_HITS] = (add ? sums[STATISTIC_HITS] : 0u) + (uint)lanes_sum(hits);
    sums[STATISTIC_STEPS] = (add ? sums[STATISTIC_STEPS] : 0u) + (uint)lanes_sum(cost.steps);
    sums[STATISTIC_ITERATIONS] = (add ? sums[STATISTIC_ITERATIONS] : 0u) + (uint)lanes_sum(cost.count);
    sums[STATISTIC_BAD_DISTANCES] = (add ? sums[STATISTIC_BAD_DISTANCES] : 0u) + (uint)lanes_sum(cost.bad);
}
