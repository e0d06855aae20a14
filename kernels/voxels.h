// Voxels as the fill evaluates them: bricks of 8 x 8 x 8, each voxel in one brick only (what is stored has a ninth layer).
//
// From the build: FILL_INSIDE, FILL_COVERAGE, FILL_ITERATIONS and which of them FILL_KIND is; SAMPLE, the type of a value;
// CHUNK, applications between two looks at a packet, a multiple of the chain's cycle.
// A brick's or node's place is packed into 64 bits: x, y and z in 21 bits each, x lowest.

#define BRICK 8
#define BRICK_VOXELS 512
// Voxels of a work-item: a packet, or a row if that is more.
#define ITEM_VOXELS (LANES < BRICK ? BRICK : LANES)

#define PLACE_X(place) ((int)((place) & 0x1fffff))
#define PLACE_Y(place) ((int)(((place) >> 21) & 0x1fffff))
#define PLACE_Z(place) ((int)((place) >> 42))

// The points of voxels `first` and those after it in a brick (x fastest): coordinates are looked up, because they are found
// in float64 and rounded once. `axes` has x, then y, then z; each has its sub-points' coordinates one after the other.
INLINE vec voxel_points(ulong place, int first, int3 sub_point, __global const scalar *axes,
                        __constant const struct Lattice *lattice) {
    __global const scalar *along_x = axes + sub_point.x * lattice->padded[0] + BRICK * PLACE_X(place);
    __global const scalar *along_y = axes + lattice->sub_points * lattice->padded[0];
    __global const scalar *along_z = along_y + lattice->sub_points * lattice->padded[1];
    along_y += sub_point.y * lattice->padded[1] + BRICK * PLACE_Y(place);
    along_z += sub_point.z * lattice->padded[2] + BRICK * PLACE_Z(place);
    scalar x[LANES], y[LANES], z[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const int at = first + lane;
        x[lane] = along_x[at & 7];
        y[lane] = along_y[(at >> 3) & 7];
        z[lane] = along_z[at >> 6];
    }
    return vec_of(lanes_load(x), lanes_load(y), lanes_load(z));
}

// Bit i of the result: whether lane i is true.
INLINE uint lanes_bits(mask m) {
    scalar each[LANES];
    lanes_store(pick(m, R(1.0), R(0.0)), each);
    uint bits = 0;
    for (int lane = 0; lane < LANES; ++lane) bits |= (each[lane] != 0 ? 1u : 0u) << lane;
    return bits;
}

// Which points belong to the solid: as `orbit_inside` at the iteration limit, in fewer operations. Lanes that escaped go on
// unheeded, and the packet is looked at every few applications. An orbit that comes back to the very same z never escapes
// (Brent 1980, "An improved Monte Carlo factorization algorithm", sec. 2: compare with a z that is renewed at powers of two).
INLINE mask solid_inside(vec point, __constant const struct Orbit *orbit, __constant const scalar *k) {
    const mask all_lanes = equal(R(0.0), R(0.0));
#if HAS_SHAPE
    return orbit_inside(point, all_lanes, orbit->iterations, orbit, k);
#else
    state c, z;
    start(point, k, &c, &z);
    const real farthest = (real)(orbit->distance_square);
    const int limit = orbit->iterations;
    real square = state_square(z);
    mask alive = less_equal(square, farthest), periodic = ~all_lanes;
    state past = z;
    int n = FIRST_COUNT, renewed = 1, chunks = 0;
    while (n + CHUNK <= limit) {
        if (!any_lane(alive & ~periodic)) break;
        #pragma unroll
        for (int step = 0; step < CHUNK; ++step) {
            z = apply(n + step, z, c, k);
            square = state_square(z);
            alive &= less_equal(square, farthest);
        }
        n += CHUNK;
#if LOGARITHMIC
        state apart = z;
        apart.s0 -= past.s0;
        apart.s1 -= past.s1;
        apart.s2 -= past.s2;
#if STATE_SIZE == 4
        apart.s3 -= past.s3;
#endif
        periodic |= alive & equal(state_square(apart), R(0.0)) & settled(square, orbit);
        if (++chunks == renewed) {
            past = z;
            renewed = 2 * chunks;
        }
#endif
    }
    const mask open = alive & ~periodic;
    if (any_lane(open)) {
        for (; n < limit; ++n) {
            z = apply(n, z, c, k);
            square = state_square(z);
            alive &= less_equal(square, farthest);
        }
    }
    return periodic | (alive & settled(square, orbit));
#endif
}
