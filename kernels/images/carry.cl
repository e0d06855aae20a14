// Entry point: a picture of a camera that moves, of which one pixel of every 2 x 2 has been rendered. What the others show is looked
// up in the picture before, and where that does not show it, it is put together of the rendered pixels around.
//
// Depth is known of the rendered pixels. So the search begins where a surface of a rendered neighbour's depth was before. What is
// found there has a place and a depth of its own; the place in which it lies now tells how far the search was off.
#include "carry_structs.h"

#define OUT_OF_SIGHT 1e30f   // farther than this nothing is known but that nothing is there
#define FOUND_WITHIN 0.55f   // pixels, of the coarser picture
#define LOOKS 3
#define SPREAD 1.0f   // times the rendered colours' range, and
#define SPARE 0.15f   // times the lightest of them

// A pixel of one picture in the other: its place in pixels, and its depth.
float4 seen_in(__constant const float *rows, int perspective, float x, float y, float depth) {
    const float w = perspective ? depth : 1.0f, a = x * w, b = y * w;
    const float across = rows[0] * a + rows[1] * b + rows[2] * depth + rows[3];
    const float down = rows[4] * a + rows[5] * b + rows[6] * depth + rows[7];
    const float far = rows[8] * a + rows[9] * b + rows[10] * depth + rows[11];
    const float share = perspective ? 1.0f / far : 1.0f;
    return (float4)(across * share, down * share, far, 0.0f);
}

// Comparisons instead of built-in functions: on processors a built-in may be a call (see direct.h).
float smaller(float a, float b) { return b < a ? b : a; }
float larger(float a, float b) { return b > a ? b : a; }
float size_of(float a) { return a < 0.0f ? -a : a; }
int within(int value, int end) { return value < 0 ? 0 : value < end ? value : end - 1; }

// What a pixel shows.
typedef struct {
    float4 color;
    float depth;
    int age, found;
} look;

// What the picture before shows of a pixel, searched from a depth on; nothing that is behind `farthest` or too old.
look before(__global const float4 *colors, __global const float *depths, __global const uchar *ages, __constant const struct Carry *c,
            int x, int y, float depth, float farthest) {
    look none = {(float4)(0.0f), depth, 0, 0};
    float4 at = seen_in(c->there, c->perspective, x, y, depth), now = at;
    int column = 0, row = 0;
    const float scale = smaller(c->finer, 1.0f);
    int there = 0;
    for (int i = 0; i < LOOKS && !there; ++i) {
        if (c->perspective && !(at.z > 0.0f)) return none;   // it was behind the eye
        if (!(at.x > -0.5f && at.y > -0.5f && at.x < c->old_width - 0.5f && at.y < c->old_height - 0.5f)) return none;
        column = (int)(at.x + 0.5f);
        row = (int)(at.y + 0.5f);
        const float known = depths[(size_t)row * c->old_width + column];
        if (!(known < OUT_OF_SIGHT)) return none;
        now = seen_in(c->back, c->perspective, column, row, known);
        const float right = x - now.x, below = y - now.y;
        there = larger(size_of(right), size_of(below)) * scale < FOUND_WITHIN;
        at.z = now.z;
        at.x = column + right * c->finer;
        at.y = row + below * c->finer;
    }
    if (!there || (c->perspective && !(now.z > 0.0f)) || now.z > farthest) return none;
    // Between four pixels, as far as they are of the same surface.
    const size_t own = (size_t)row * c->old_width + column;
    const int left = (int)(at.x + 1.0f) - 1, top = (int)(at.y + 1.0f) - 1;
    const int u = within(left, c->old_width), v = within(left + 1, c->old_width);
    const size_t above = (size_t)within(top, c->old_height) * c->old_width;
    const size_t under = (size_t)within(top + 1, c->old_height) * c->old_width;
    const float across = at.x - left, down = at.y - top, depth_here = depths[own];
    const float near = c->step * (c->perspective ? depth_here : 1.0f);
#define SHARE(place, share) (size_of(depths[place] - depth_here) <= near ? (share) : 0.0f)
    const float first = SHARE(above + u, (1.0f - across) * (1.0f - down)), second = SHARE(above + v, across * (1.0f - down));
    const float third = SHARE(under + u, (1.0f - across) * down), fourth = SHARE(under + v, across * down);
    const float sum = first + second + third + fourth;
    look all = {colors[own], now.z, 1 + (c->old_is_carried ? ages[own] : 0), 0};
    if (sum > 0.0f) {
        all.color = (first * colors[above + u] + second * colors[above + v] + third * colors[under + u] + fourth * colors[under + v]) *
                    (1.0f / sum);
    }
    all.found = all.age <= c->oldest;
    return all;
}

// A colour near those of the rendered pixels around: highlights move with the eye, and not with what they lie on.
float4 near_to(float4 color, __global const float4 *colors, const size_t *around) {
    float4 lowest = colors[around[0]], highest = lowest;
    for (int i = 1; i < 4; ++i) {
        const float4 other = colors[around[i]];
        lowest = other < lowest ? other : lowest;
        highest = other > highest ? other : highest;
    }
    const float4 more = SPREAD * (highest - lowest) + SPARE * highest;
    lowest -= more;
    highest += more;
    color = color < lowest ? lowest : color;
    return color > highest ? highest : color;
}

__kernel void carry(__global const float4 *fresh_colors, __global const float *fresh_depths, __global const float4 *old_colors,
                    __global const float *old_depths, __global const uchar *old_ages, __global float4 *colors, __global float *depths,
                    __global uchar *ages, __constant const struct Carry *c) {
    const int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (x >= c->width || y >= c->height) return;
    fresh_colors += c->fresh_offset;
    fresh_depths += c->fresh_offset;
    const size_t here = (size_t)c->offset + (size_t)y * c->width + x;
    // The rendered pixels around: four, or twice two, or four times the pixel itself.
    const int column = (x - c->phase_x) >> 1, row = (y - c->phase_y) >> 1;
    const int is_right = (x - c->phase_x) & 1, is_below = (y - c->phase_y) & 1;
    size_t around[4];
    float nearest = INFINITY, farthest = -OUT_OF_SIGHT;
    int open = 0;
    for (int i = 0; i < 4; ++i) {
        const int u = within(column + (i & is_right), c->fresh_width), v = within(row + ((i >> 1) & is_below), c->fresh_height);
        around[i] = (size_t)v * c->fresh_width + u;
        const float depth = fresh_depths[around[i]];
        if (depth < OUT_OF_SIGHT) {
            nearest = smaller(nearest, depth);
            farthest = larger(farthest, depth);
        } else {
            open = 1;
        }
    }
    if (!is_right && !is_below) {
        colors[here] = fresh_colors[around[0]];
        depths[here] = fresh_depths[around[0]];
        ages[here] = 0;
        return;
    }
    look seen = {(float4)(0.0f), INFINITY, 0, 0};
    if (nearest < OUT_OF_SIGHT) {
        const float near = c->step * (c->perspective ? nearest : 1.0f), last = open ? INFINITY : farthest + near;
        seen = before(old_colors + c->old_offset, old_depths + c->old_offset, old_ages + c->old_offset, c, x, y, nearest, last);
        if (!seen.found && farthest > nearest + near) {
            seen = before(old_colors + c->old_offset, old_depths + c->old_offset, old_ages + c->old_offset, c, x, y, farthest, last);
        }
        if (seen.found) {
            seen.color = near_to(seen.color, fresh_colors, around);
        } else {
            // What came into sight may be on either side of an edge: it is drawn softly, and is not carried on from there.
            seen.color = (float4)(0.0f);
            for (int i = 0; i < 4; ++i) seen.color += 0.25f * fresh_colors[around[i]];
            seen.depth = open ? INFINITY : farthest;
            seen.age = c->oldest;
        }
    } else {
        for (int i = 0; i < 4; ++i) seen.color += 0.25f * fresh_colors[around[i]];
    }
    colors[here] = seen.color;
    depths[here] = seen.depth;
    ages[here] = (uchar)seen.age;
}
