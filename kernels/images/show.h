// What turns canvases into the numbers that a screen wants: exposure, tone, two eyes into one picture, sRGB, dither.
//
// The arithmetic is the one of picture files, operation by operation (clfractal/images/develop.py, compose.py, anaglyph.py
// and clfractal/files/srgb.py), so that a window and a file show the same.
#include "show_structs.h"
#pragma OPENCL FP_CONTRACT OFF
#include "images/tone.h"

// A mixing of colours limits numbers to this, as `anaglyph.mix` does.
#define LIGHTEST 1e30f
// Neighbours whose coverage differs by a quarter and more are not smoothed into each other.
#define COVERAGE_APART 4.0f

// Comparisons instead of built-in functions: on processors a built-in may be a call (see direct.h).
float limited(float value) {
    if (value != value) return 0.0f;
    return value > LIGHTEST ? LIGHTEST : value < -LIGHTEST ? -LIGHTEST : value;
}

float smaller(float a, float b) { return b < a ? b : a; }
int lower(int a, int b) { return b < a ? b : a; }
float4 between(float4 a, float4 b, float share) { return a + (b - a) * share; }

int is_light(float4 found) {
    return found.x >= -LIGHTEST && found.x <= LIGHTEST && found.y >= -LIGHTEST && found.y <= LIGHTEST &&
           found.z >= -LIGHTEST && found.z <= LIGHTEST;
}

// What a pixel gets from a neighbour: as much as the neighbour loses.
float4 gained(float4 own, float4 other, float share) {
    const float apart = own.w < other.w ? other.w - own.w : own.w - other.w;
    const float alike = 1.0f - COVERAGE_APART * apart;
    if (!(alike > 0.0f) || !is_light(other)) return (float4)(0.0f);
    return (other - own) * (share * alike);
}

// One view of a canvas while its picture is under way: its noise is smoothed by one step of diffusion. Each pair of
// neighbours exchanges a share of its difference, so the mean of the picture stays what it is. At most 3/8
// come from neighbours, which is nearer to the picture of many samples than less or more, and nothing where coverage differs, so
// that outlines stay as they are. What is infinite or no number is nobody's neighbour, and neither is what lies behind the
// borders of the view.
__kernel void diffuse(__global const float4 *colors, __constant const struct ShownView *views, int number,
                      __global float4 *smoothed) {
    __constant const struct ShownView *view = views + number;
    const int x = (int)get_global_id(0), y = (int)get_global_id(1), width = view->width, height = view->height;
    if (x >= width || y >= height) return;
    __global const float4 *here = colors + view->offset + (size_t)y * width + x;
    const float4 own = *here;
    float4 sum = (float4)(0.0f);
    if (is_light(own)) {
        const float beside = 0.0625f * view->smoothing, corner = 0.03125f * view->smoothing;
        for (int down = -1; down <= 1; ++down) {
            for (int right = -1; right <= 1; ++right) {
                const int there = x + right >= 0 && x + right < width && y + down >= 0 && y + down < height;
                if (!there || (down == 0 && right == 0)) continue;
                sum += gained(own, here[down * width + right], down != 0 && right != 0 ? corner : beside);
            }
        }
    }
    smoothed[here - colors] = (float4)(own.x + sum.x, own.y + sum.y, own.z + sum.z, own.w);
}

// One view of a picture, or where there is none (between the views of a layout) the background.
float4 view_at(__global const float4 *colors, __constant const struct ShownView *view, __constant const struct Show *show,
               int x, int y) {
    const int column = x - view->left, row = y - view->top;
    __global const float4 *from = colors + view->offset;
    if (view->divider == 1) return from[(size_t)row * view->width + column];
    if (!show->smooth) {
        return from[(size_t)lower(row / view->divider, view->height - 1) * view->width +
                    lower(column / view->divider, view->width - 1)];
    }
    // A coarse picture's rays are those of every `divider`th pixel.
    const float across = smaller((float)column / view->divider, view->width - 1.0f);
    const float down = smaller((float)row / view->divider, view->height - 1.0f);
    const int left = (int)across, upper = (int)down;
    const int right = lower(left + 1, view->width - 1);
    __global const float4 *above = from + (size_t)upper * view->width;
    __global const float4 *below = from + (size_t)lower(upper + 1, view->height - 1) * view->width;
    return between(between(above[left], above[right], across - left), between(below[left], below[right], across - left),
                   down - upper);
}

// The pixel (x, y) of an eye's picture, as light.
float4 light_at(__global const float4 *colors, __constant const struct ShownView *views, __constant const struct Show *show,
                int eye, int x, int y) {
    // Views that come later lie over those before.
    for (int number = show->views - 1; number >= 0; --number) {
        __constant const struct ShownView *view = views + number;
        if (view->eye == eye && x >= view->left && y >= view->top && x < view->right && y < view->bottom) {
            return view_at(colors, view, show, x, y);
        }
    }
    return (float4)(show->background[0], show->background[1], show->background[2], 1.0f);
}

// The same developed, as `Development.colors` does: light that a screen shows.
float4 eye_at(__global const float4 *colors, __constant const struct ShownView *views, __constant const struct Show *show,
              __global const float *tones, int eye, int x, int y) {
    float4 found = light_at(colors, views, show, eye, x, y);
    const float cover = found.w;
    found *= show->gain;
    if (show->tone != TONE_LINEAR) {
        // Colours of a transparent picture are premultiplied; where nothing covers, as where all is covered, they are as they are.
        const float divisor = show->transparent && cover > 0.0f && cover < 1.0f ? cover : 1.0f;
        found = toned(found / divisor, tones, show->tone) * divisor;
    }
    found.w = cover;
    return found;
}

float mixed(__constant const float *by, float4 left, float4 right) {
    float sum = 0.0f;
    // Terms without a coefficient are left out: infinity times 0 is not 0.
    if (by[0] != 0.0f) sum += limited(left.x) * by[0];
    if (by[1] != 0.0f) sum += limited(left.y) * by[1];
    if (by[2] != 0.0f) sum += limited(left.z) * by[2];
    if (by[3] != 0.0f) sum += limited(right.x) * by[3];
    if (by[4] != 0.0f) sum += limited(right.y) * by[4];
    if (by[5] != 0.0f) sum += limited(right.z) * by[5];
    return sum > 0.0f ? sum : 0.0f;
}

float4 composed_at(__global const float4 *colors, __constant const struct ShownView *views,
                   __constant const struct Show *show, __global const float *tones, int x, int y) {
    const int mode = show->mode;
    if (mode == MODE_ONE) return eye_at(colors, views, show, tones, show->first, x, y);
    if (mode == MODE_BESIDE) {
        const int second = x >= show->eye_width;
        return eye_at(colors, views, show, tones, second ? 1 - show->first : show->first, x - second * show->eye_width, y);
    }
    if (mode == MODE_BELOW) {
        const int second = y >= show->eye_height;
        return eye_at(colors, views, show, tones, second ? 1 - show->first : show->first, x, y - second * show->eye_height);
    }
    if (mode == MODE_ANAGLYPH) {
        const float4 left = eye_at(colors, views, show, tones, show->first, x, y);
        const float4 right = eye_at(colors, views, show, tones, 1 - show->first, x, y);
        return (float4)(mixed(show->matrix, left, right), mixed(show->matrix + 6, left, right),
                        mixed(show->matrix + 12, left, right), left.w < right.w ? right.w : left.w);
    }
    const int odd = (mode == MODE_ROWS ? y : mode == MODE_COLUMNS ? x : x + y) & 1;
    float4 found = eye_at(colors, views, show, tones, odd ? 1 - show->first : show->first, x, y);
    if (mode == MODE_CHESSBOARD) {
        __constant const float *passed = show->matrix + 3 * odd;
        found.x = passed[0] == 0.0f ? 0.0f : found.x * passed[0];
        found.y = passed[1] == 0.0f ? 0.0f : found.y * passed[1];
        found.z = passed[2] == 0.0f ? 0.0f : found.z * passed[2];
    }
    return found;
}

// Bayer's thresholds: the bits of x xor y and of y, from the last on, interleaved (see srgb.py).
int threshold_at(int x, int y) {
    int order = 0;
    for (int bit = 0; bit < 4; ++bit) {
        const int across = x >> bit & 1, down = y >> bit & 1;
        order = order * 4 + ((across ^ down) << 1 | down);
    }
    return 4 + order * 248 / 256;
}

uchar coded(float linear, __global const ushort *table, int threshold) {
    int index = as_int(linear > 0.0f ? linear : 0.0f) >> TABLE_SHIFT;  // not a number counts as 0
    index = (index < TABLE_LOWEST ? TABLE_LOWEST : index > TABLE_ONE ? TABLE_ONE : index) - TABLE_LOWEST;
    return (uchar)((table[index] + threshold) >> 8);
}

// The numbers of a pixel of what is shown.
uchar4 shown_at(__global const float4 *colors, __constant const struct ShownView *views, __constant const struct Show *show,
                __global const ushort *table, __global const float *tones, int x, int y) {
    float4 found = composed_at(colors, views, show, tones, x, y);
    if (show->transparent && found.w < 1.0f) {
        // Colours are premultiplied; what lies behind them is a board of two greys.
        const float behind = ((x >> 3 ^ y >> 3) & 1) ? 0.13f : 0.10f;
        const float seen = (found.w > 0.0f ? 1.0f - found.w : 1.0f) * behind;
        found.x += seen;
        found.y += seen;
        found.z += seen;
    }
    const int threshold = threshold_at(x & 15, y & 15);
    return (uchar4)(coded(found.x, table, threshold), coded(found.y, table, threshold), coded(found.z, table, threshold), 255);
}
