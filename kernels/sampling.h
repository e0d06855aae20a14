// Where in a pixel its samples lie: a Hammersley set (Niederreiter 1992, ch. 3), so that every one of N equal strips of the
// pixel holds exactly one sample in either direction, turned by a random amount from pixel to pixel (Cranley and Patterson
// 1976) so that neighbours do not repeat each other's pattern. It depends on the pixel's place in the picture alone.

// Integer hash with full avalanche (the finaliser of MurmurHash3, Appleby 2011).
INLINE uint hash(uint a) {
    a ^= a >> 16;
    a *= 0x85ebca6bu;
    a ^= a >> 13;
    a *= 0xc2b2ae35u;
    return a ^ (a >> 16);
}

INLINE uint reverse_bits(uint a) {
    a = (a << 16) | (a >> 16);
    a = ((a & 0x00ff00ffu) << 8) | ((a >> 8) & 0x00ff00ffu);
    a = ((a & 0x0f0f0f0fu) << 4) | ((a >> 4) & 0x0f0f0f0fu);
    a = ((a & 0x33333333u) << 2) | ((a >> 2) & 0x33333333u);
    return ((a & 0x55555555u) << 1) | ((a >> 1) & 0x55555555u);
}

// Offset of a sample from the pixel's top left corner, in pixels, both in [0, 1). One sample lies at the centre.
INLINE void sample_offset(int x, int y, int sample, int samples, uint seed, scalar *across, scalar *below) {
    if (samples == 1) {
        *across = S(0.5);
        *below = S(0.5);
        return;
    }
    const uint turn = hash((uint)x + hash((uint)y + hash(seed)));
    const float unit = 1.0f / 16777216.0f;
    const float u = ((float)sample + 0.5f) / (float)samples + (float)(turn >> 8) * unit;
    const float v = (float)(reverse_bits((uint)sample) >> 8) * unit + (float)(hash(turn) >> 8) * unit;
    *across = (scalar)(u - floor(u));
    *below = (scalar)(v - floor(v));
}
