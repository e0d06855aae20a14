// Entry point of what shows canvases: to a buffer.
#include "images/show.h"

__kernel void show(__global const float4 *colors, __constant const struct ShownView *views,
                   __constant const struct Show *show, __global const ushort *table, __global const float *tones,
                   __global uchar4 *shown) {
    const int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (x >= show->width || y >= show->height) return;
    const uchar4 pixel = shown_at(colors, views, show, table, tones, x, y);
    shown[(size_t)y * show->width + x] = pixel;
}
