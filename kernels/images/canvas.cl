// The canvas: pictures on the device, put together from finished tiles, for showing them.
//
// Each picture begins at `offset` pixels of the canvas and is stored row by row: colours with coverage, and depths.

#define TILE_PIXELS (TILE * TILE)

// Copies finished tiles of one launch. Framebuffer: [tile][R, G, B, A, Z][row][column]. `left` and `top` are the first pixel that the
// canvas holds, `clip` (left, top, right, bottom) is what was rendered. One work-item takes one row of a tile.
__kernel void place_tiles(__global const float *framebuffer, __global const int4 *places, __global float4 *colors,
                          __global float *depths, int offset, int left, int top, int width, int clip_left, int clip_top, int clip_right,
                          int clip_bottom) {
    const int row = (int)get_global_id(0), tile = (int)get_global_id(1);
    const int x = places[tile].x, y = places[tile].y + row;
    if (y < clip_top || y >= clip_bottom) return;
    __global const float *from = framebuffer + (size_t)tile * CHANNELS * TILE_PIXELS + row * TILE;
    const long to = offset + (long)(y - top) * width + x - left;
    const int first = x < clip_left ? clip_left - x : 0, end = clip_right - x < TILE ? clip_right - x : TILE;
    for (int column = first; column < end; ++column) {
        colors[to + column] = (float4)(from[column], from[column + TILE_PIXELS], from[column + 2 * TILE_PIXELS],
                                       from[column + 3 * TILE_PIXELS]);
        depths[to + column] = from[column + 4 * TILE_PIXELS];
    }
}

// Fills a picture with an older one of another size: each pixel takes the old one that lies there.
__kernel void enlarge(__global const float4 *old_colors, __global const float *old_depths, int old_offset, int old_width,
                      int old_height, __global float4 *colors, __global float *depths, int offset, int width, int height,
                      float across, float down) {
    const int x = (int)get_global_id(0), y = (int)get_global_id(1);
    if (x >= width || y >= height) return;
    int from_x = (int)(x * across), from_y = (int)(y * down);
    from_x = from_x < old_width ? from_x : old_width - 1;
    from_y = from_y < old_height ? from_y : old_height - 1;
    const size_t from = (size_t)old_offset + (size_t)from_y * old_width + from_x;
    const size_t to = (size_t)offset + (size_t)y * width + x;
    colors[to] = old_colors[from];
    depths[to] = old_depths[from];
}
