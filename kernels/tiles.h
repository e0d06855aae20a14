// A packet's pixels in its tile. A tile is TILE x TILE pixels, its pixels numbered along the Morton curve: any LANES in a row
// form a compact patch whose rays stay together. Film layout: [tile][channel][row][column], TILE x TILE floats a channel.
#define TILE_PIXELS (TILE * TILE)

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
INLINE packet_pixels packet_at(int packet, int2 corner, __constant const struct View *view) {
    packet_pixels p;
    scalar wanted[LANES], x[LANES], y[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const int number = packet * LANES + lane;
        const int column = morton_column(number), row = morton_column(number >> 1);
        p.columns[lane] = corner.x + column;
        p.rows[lane] = corner.y + row;
        p.place[lane] = row * TILE + column;
        x[lane] = (scalar)p.columns[lane] + S(0.5);
        y[lane] = (scalar)p.rows[lane] + S(0.5);
        wanted[lane] = (p.columns[lane] >= view->region_left && p.columns[lane] < view->region_right &&
                        p.rows[lane] >= view->region_top && p.rows[lane] < view->region_bottom)
                           ? S(1.0) : S(0.0);
    }
    p.in_region = less(R(0.0), lanes_load(wanted));
    p.x = lanes_load(x);
    p.y = lanes_load(y);
    return p;
}

// `slot`: the channel's place among the wanted ones, or -1; `film` begins at the tile.
INLINE void write_channel(__global float *film, int slot, const int *place, real value) {
    if (slot < 0) return;
    scalar each[LANES];
    lanes_store(value, each);
    for (int lane = 0; lane < LANES; ++lane) film[slot * TILE_PIXELS + place[lane]] = (float)each[lane];
}
