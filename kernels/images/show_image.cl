// Entry point of what shows canvases: to an image, which not every device has.
#include "images/show.h"

__kernel void show(__global const float4 *colors, __constant const struct ShownView *views,
                   __constant const struct Show *show, __global const ushort *table, __global const float *tones,
                   __write_only image2d_t shown) {
    const int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (x >= show->width || y >= show->height) return;
    const uchar4 pixel = shown_at(colors, views, show, table, tones, x, y);
    write_imagef(shown, (int2)(x, y), convert_float4(pixel) / 255.0f);
}
