// The sums over the samples of a pixel, for every renderer.
#include "device/memory.h"
#include "path_state.h"

// The results of one sample.
typedef struct {
    color radiance;       // over the background; premultiplied where that is transparent
    mask hit;             // of the rest: where anything was found
    real coverage;        // part of the sample that found something
    real depth;           // along the view axis
    vec normal, point;
    real smooth, steps;   // escape count; evaluations
    parts of_light;
    real thing, covers;   // the number of what is seen, from 1, and what it covers
} pixel_sample;

INLINE pixel pixel_start(void) {
    pixel p = {0};
    p.nearest = (real)(REAL_LARGEST);
    return p;
}

// `offset`: distance squared of the sample from the pixel's middle, pixels.
INLINE void pixel_add(pixel *p, pixel_sample s, mask active, real offset) {
    const real one = pick(active, R(1.0), R(0.0));
    p->radiance = color_pick(active, color_add(p->radiance, s.radiance), p->radiance);
    p->coverage += pick(active, s.coverage, R(0.0));
    p->samples += one;
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

// Adds a sample to the sums for a pixel's noise: perceived brightness (the square root of luminance), and coverage.
INLINE void noise_add(pixel *p, pixel_sample s, mask active) {
    const real luminance = R(0.2126) * s.radiance.r + R(0.7152) * s.radiance.g + R(0.0722) * s.radiance.b;
    const real seen = pick(active, sqrt(fmax(luminance, R(0.0))), R(0.0));
    p->brightness += seen;
    p->brightness_square += seen * seen;
    p->coverage_square += pick(active, s.coverage * s.coverage, R(0.0));
}

// The standard error of a pixel's mean: of its brightness, or of its coverage if that error is larger and coverage is shown.
INLINE real noise_of(const pixel *p, int transparent) {
    const real share = R(1.0) / p->samples;
    const real mean = p->brightness * share, coverage = p->coverage * share;
    const real of_coverage = transparent ? p->coverage_square * share - coverage * coverage : R(0.0);
    const real variance = fmax(p->brightness_square * share - mean * mean, of_coverage);
    return sqrt(fmax(variance, R(0.0)) / fmax(p->samples - R(1.0), R(1.0)));
}

// Which number of a pixel a channel shows: both are listed in the same order, but for the count of samples.
INLINE int number_of_channel(int channel) {
    return channel <= CHANNEL_A ? channel : channel == CHANNEL_SAMPLES ? KEPT_SAMPLES : channel - CHANNEL_Z + KEPT_DEPTH;
}

// Writes a pixel's channels; `slots` has for each channel its place among the wanted ones, or -1; `framebuffer` begins at the tile. Light
// and coverage are means.
INLINE void pixel_write(__global float *framebuffer, __global const int *slots, const int *place, const pixel *p) {
    const real share = R(1.0) / fmax(p->samples, R(1.0));
#define WRITE_CHANNEL(i)                                              \
    real value = ((const real *)p)[number_of_channel(i)];             \
    if (i <= CHANNEL_A) value *= share;                               \
    write_channel(framebuffer, slots[i], place, value);
    FOR_NUMBERS(RAY_CHANNELS, WRITE_CHANNEL)
}

INLINE void parts_add(parts *sum, parts more, mask active) {
#define ADD_PART(i) ((real *)sum)[i] += pick(active, ((const real *)&more)[i], R(0.0));
    FOR_NUMBERS(NUMBERS_OF(parts), ADD_PART)
}

// Writes their means, of this many samples; their channels follow those that every renderer has.
INLINE void parts_write(__global float *framebuffer, __global const int *slots, const int *place, const parts *sum, real samples) {
    const real share = R(1.0) / fmax(samples, R(1.0));
#define WRITE_PART(i) write_channel(framebuffer, slots[RAY_CHANNELS + i], place, ((const real *)sum)[i] * share);
    FOR_NUMBERS(NUMBERS_OF(parts), WRITE_PART)
}

// `nearest`: whether this sample is the nearest to the pixel's middle so far.
INLINE void cryptomatte_add(cryptomatte *sum, real thing, real covers, mask active, mask nearest) {
    sum->nearest = pick(nearest, thing, sum->nearest);
    mask waits = active & less(R(0.0), thing) & less(R(0.0), covers);
    for (int rank = 0; rank < CRYPTOMATTE_RANKS; ++rank) {
        real *pair = sum->pairs + 2 * rank;
        const mask fits = waits & (equal(pair[0], thing) | equal(pair[0], R(0.0)));
        pair[0] = pick(fits, thing, pair[0]);
        pair[1] += pick(fits, covers, R(0.0));
        waits &= ~fits;
    }
}

// Writes them; `clfractal/shading/cryptomatte.py` makes of them what the channels of objects and of materials tell.
INLINE void cryptomatte_write(__global float *framebuffer, __global const int *slots, const int *place, const cryptomatte *sum, real samples) {
    const real share = R(1.0) / fmax(samples, R(1.0));
    write_channel(framebuffer, slots[CHANNEL_OBJECT], place, sum->nearest);
    write_channel(framebuffer, slots[CHANNEL_MATERIAL], place, sum->nearest);
    for (int i = 0; i < 2 * CRYPTOMATTE_RANKS; ++i) {
        const real value = sum->pairs[i] * (i & 1 ? share : R(1.0));
        write_channel(framebuffer, slots[CHANNEL_CRYPTOOBJECT00R + i], place, value);
        write_channel(framebuffer, slots[CHANNEL_CRYPTOMATERIAL00R + i], place, value);
    }
}
