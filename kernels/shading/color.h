// Colours and palettes.
#define color_splat(c) color_of((real)((c)[0]), (real)((c)[1]), (real)((c)[2]))  // of a struct in any memory
INLINE color color_mix(color a, color b, real share) {
    return color_of(a.r + (b.r - a.r) * share, a.g + (b.g - a.g) * share, a.b + (b.b - a.b) * share);
}
INLINE real brightest(color c) { return fmax(fmax(c.r, c.g), c.b); }

// A colour whose brightest component is at most the limit: one sample must not outshine all others of its pixel.
INLINE color color_limited(color c, real limit) {
    const real most_of_it = brightest(c);
    return color_scale(c, pick(less(limit, most_of_it), limit / most_of_it, R(1.0)));
}

// Where a quantity lies in the palette, 0 to 1, at scale * quantity + offset: the palette repeats, or its ends go on.
INLINE real place_in_palette(real quantity, scalar scale, scalar offset, int repeat) {
    const real where = quantity * (real)(scale) + (real)(offset);
    const real place = repeat ? where - floor(where) : clamp(where, R(0.0), R(1.0));
    return pick(is_nan(place), R(0.0), place);
}

// A palette of PALETTE_SIZE colours, entry i at i / (PALETTE_SIZE - 1), blended linearly between neighbours. One that repeats
// is squeezed by a 256th, where its last colour blends into its first.
INLINE color palette_color(real place, int repeat, __global const float *palette) {
    const int intervals = repeat ? PALETTE_SIZE : PALETTE_SIZE - 1;
    scalar at[LANES];
    float low[3][LANES], high[3][LANES], share[LANES];
    lanes_store(place * (real)((scalar)intervals), at);
    for (int lane = 0; lane < LANES; ++lane) {
        const int first = clamp((int)at[lane], 0, intervals - 1);
        const int second = (first + 1) & (PALETTE_SIZE - 1);
        share[lane] = (float)at[lane] - (float)first;
        for (int i = 0; i < 3; ++i) {
            low[i][lane] = palette[3 * first + i];
            high[i][lane] = palette[3 * second + i];
        }
    }
    // In separate loops, each of which compilers turn into one instruction.
    scalar mixed[3][LANES];
    for (int i = 0; i < 3; ++i) {
        for (int lane = 0; lane < LANES; ++lane) mixed[i][lane] = mix(low[i][lane], high[i][lane], share[lane]);
    }
    return color_of(lanes_load(mixed[0]), lanes_load(mixed[1]), lanes_load(mixed[2]));
}
