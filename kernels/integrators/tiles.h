// A packet's pixels in its tile. A tile is TILE x TILE pixels, its pixels numbered along the Morton curve: any LANES in a row
// form a compact patch whose rays stay together. Framebuffer layout: [tile][channel][row][column], TILE x TILE floats a channel.
#define TILE_PIXELS (TILE * TILE)
// Blocks of BLOCK x BLOCK pixels stand one after the other on the curve.
#define BLOCK 8
#define PACKETS_OF_BLOCK (BLOCK * BLOCK / LANES)
INLINE int block_of_packet(int packet) { return packet / PACKETS_OF_BLOCK; }

// Even bits of a Morton number, gathered: its column. Its row is the same of the number shifted by one.
INLINE int morton_column(int m) {
    m &= 0x55555555;
    m = (m | (m >> 1)) & 0x33333333;
    m = (m | (m >> 2)) & 0x0f0f0f0f;
    return (m | (m >> 4)) & 0x00ff00ff;
}

typedef struct {
    int place[LANES];                  // in the tile, row by row
    int columns[LANES], rows[LANES];   // in the picture
    real x, y;                         // of the pixels' middles, pixels from the picture's top left corner
    mask in_region;                    // pixels that are to be rendered
} packet_pixels;

// The pixels of packet number `packet` of a tile whose top left pixel is `corner`.
INLINE packet_pixels packet_at(int packet, int2 corner, view_record view) {
    packet_pixels p;
    // The bits of a packet's number and of a lane's are apart, so that their columns add up.
    const int first = packet * LANES;
    const int left = morton_column(first), top = morton_column(first >> 1);
    scalar x[LANES], y[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const int column = left + morton_column(lane), row = top + morton_column(lane >> 1);
        p.place[lane] = row * TILE + column;
        p.columns[lane] = corner.x + column;
        p.rows[lane] = corner.y + row;
        x[lane] = (scalar)morton_column(lane) + S(0.5);
        y[lane] = (scalar)morton_column(lane >> 1) + S(0.5);
    }
    p.x = lanes_load(x) + (real)((scalar)(corner.x + left));
    p.y = lanes_load(y) + (real)((scalar)(corner.y + top));
    p.in_region = less((real)((scalar)view->region_left), p.x) & less(p.x, (real)((scalar)view->region_right)) &
                  less((real)((scalar)view->region_top), p.y) & less(p.y, (real)((scalar)view->region_bottom));
    return p;
}

// Any pixels of a tile, by their numbers on the curve, of which all are to be rendered.
INLINE packet_pixels pixels_at(const int *numbers, int2 corner) {
    packet_pixels p;
    scalar x[LANES], y[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const int column = morton_column(numbers[lane]), row = morton_column(numbers[lane] >> 1);
        p.place[lane] = row * TILE + column;
        p.columns[lane] = corner.x + column;
        p.rows[lane] = corner.y + row;
        x[lane] = (scalar)p.columns[lane] + S(0.5);
        y[lane] = (scalar)p.rows[lane] + S(0.5);
    }
    p.x = lanes_load(x);
    p.y = lanes_load(y);
    p.in_region = less(R(0.0), R(1.0));
    return p;
}

// `slot`: the channel's place among the wanted ones, or -1; `framebuffer` begins at the tile.
INLINE void write_channel(__global float *framebuffer, int slot, const int *place, real value) {
    if (slot < 0) return;
    scalar each[LANES];
    lanes_store(value, each);
    __global float *to = framebuffer + slot * TILE_PIXELS;
#if LANES >= 8
    // Four in a row: the curve goes through 2 x 2 pixels, then through those right of them, then through the 4 x 2 below.
    for (int row = 0; row < LANES / 4; ++row) {
        const int lane = (row & 1) * 2 + (row >> 1) * 8;
        vstore4((float4)((float)each[lane], (float)each[lane + 1], (float)each[lane + 4], (float)each[lane + 5]), 0,
                to + place[lane]);
    }
#else
    for (int lane = 0; lane < LANES; ++lane) to[place[lane]] = (float)each[lane];
#endif
}
