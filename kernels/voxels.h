// Voxels as the fill evaluates them: bricks of 8 x 8 x 8, each voxel in one brick only (stored bricks have a ninth layer).
//
// From the build: FILL_INSIDE, FILL_COVERAGE, FILL_ITERATIONS and which of them FILL_KIND is; SAMPLE, the type of a value;
// CHUNK, applications between two looks at a packet, a multiple of the chain's cycle; REPEATS_FROM, the application from which
// on a chain's turns repeat themselves.
// A brick's or node's place is packed into 64 bits: x, y and z in 21 bits each, x lowest.

#define BRICK 8
#define BRICK_VOXELS 512
// Voxels are in the order of a brick's octants, 4 x 4 x 4 (x fastest, in and between them): packets that are compact end
// together, and octants can be left out.
#define OCTANT_VOXELS 64
// Packets whose orbits are computed side by side, so that one goes on while another waits for a result. Where there is one
// lane, the device has other work-items for that.
#if LANES == 1
#define PACKETS 1
#else
#define PACKETS 2
#endif
// Voxels of a work-item, 8 at least: of the bits that are stored for them no two work-items share a byte.
#define ITEM_VOXELS (LANES * PACKETS < 8 ? 8 : LANES * PACKETS)

#define PLACE_X(place) ((int)((place) & 0x1fffff))
#define PLACE_Y(place) ((int)(((place) >> 21) & 0x1fffff))
#define PLACE_Z(place) ((int)((place) >> 42))

// The points of voxels `first` and those after it in a brick: coordinates are looked up, because they are found in float64
// and rounded once. `axes` has x, then y, then z; each has its sub-points' coordinates one after the other.
INLINE vec voxel_points(ulong place, int first, int4 sub_point, __global const scalar *axes,
                        __constant const struct Lattice *lattice) {
    const int octant = first / OCTANT_VOXELS;
    __global const scalar *along_x = axes + sub_point.x * lattice->padded[0];
    __global const scalar *along_y = axes + lattice->sub_points * lattice->padded[0];
    __global const scalar *along_z = along_y + lattice->sub_points * lattice->padded[1];
    along_x += BRICK * PLACE_X(place) + 4 * (octant & 1);
    along_y += sub_point.y * lattice->padded[1] + BRICK * PLACE_Y(place) + 4 * ((octant >> 1) & 1);
    along_z += sub_point.z * lattice->padded[2] + BRICK * PLACE_Z(place) + 4 * (octant >> 2);
    scalar x[LANES], y[LANES], z[LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        const int at = first + lane;
        x[lane] = along_x[at & 3];
        y[lane] = along_y[(at >> 2) & 3];
        z[lane] = along_z[(at >> 4) & 3];
    }
    return vec_of(lanes_load(x), lanes_load(y), lanes_load(z));
}

// The square of how far apart two states are, where orbits may come back.
INLINE real apart_square(state z, state past) {
    state apart = {z.s0 - past.s0, z.s1 - past.s1, z.s2 - past.s2};
#if STATE_SIZE == 4
    apart.s3 = z.s3 - past.s3;
#endif
    return state_square(apart);
}

// Which points belong to the solid: as `orbit_inside` at the iteration limit, in fewer operations. An orbit that comes back to
// the very same z never escapes (Brent 1980, "An improved Monte Carlo factorization algorithm", sec. 2: compare with a z that is
// renewed at powers of two). Packets are tested every few applications, and lanes that escaped continue without effect. One
// lane ends at once, and has neither arrays nor loops of a constant count (see TURNS in lanes.h).
#if HAS_SHAPE
INLINE void solid_inside(const vec *points, mask *inside, __constant const struct Orbit *orbit, __constant const scalar *k) {
    const mask all_lanes = equal(R(0.0), R(0.0));
    for (int p = 0; p < TURNS(PACKETS); ++p) inside[p] = orbit_inside(points[p], all_lanes, orbit->iterations, orbit, k);
}
#elif LANES == 1
INLINE void solid_inside(const vec *points, mask *inside, __constant const struct Orbit *orbit, __constant const scalar *k) {
    const real farthest = orbit->distance_square;
    const int limit = orbit->iterations;
    state c, z;
    start(points[0], k, &c, &z);
    state past = z;
    real square = state_square(z);
    mask alive = less_equal(square, farthest);
    int look = FIRST_COUNT + CHUNK, looks = 0, renewed = 1;
    int comparable = FIRST_COUNT >= REPEATS_FROM;  // equal states have equal futures only where the turns repeat
    for (int n = FIRST_COUNT; n < limit && alive; ++n) {
        z = apply(n, z, c, k);
        square = state_square(z);
        alive = less_equal(square, farthest);
        if (n + 1 < look) continue;
        look += CHUNK;
        if ((++looks & 1023) == 0 && orbit_cancelled(orbit)) break;
#if LOGARITHMIC
        if (comparable && equal(apart_square(z, past), R(0.0)) && settled(square, orbit)) break;
        if (looks == renewed) {
            past = z;
            renewed *= 2;
            comparable = n + 1 >= REPEATS_FROM;
        }
#endif
    }
    inside[0] = alive & settled(square, orbit);
}
#else
INLINE void solid_inside(const vec *points, mask *inside, __constant const struct Orbit *orbit, __constant const scalar *k) {
    const mask all_lanes = equal(R(0.0), R(0.0));
    const real farthest = (real)(orbit->distance_square);
    const int limit = orbit->iterations;
    state c[PACKETS], z[PACKETS], past[PACKETS];
    real square[PACKETS];
    mask alive[PACKETS], periodic[PACKETS];
    mask open = ~all_lanes;
    #pragma unroll
    for (int p = 0; p < TURNS(PACKETS); ++p) {
        start(points[p], k, &c[p], &z[p]);
        past[p] = z[p];
        square[p] = state_square(z[p]);
        alive[p] = less_equal(square[p], farthest);
        periodic[p] = ~all_lanes;
        open |= alive[p];
    }
    int n = FIRST_COUNT, renewed = 1, chunks = 0;
    int comparable = FIRST_COUNT >= REPEATS_FROM;  // as above
    while (n + CHUNK <= limit && any_lane(open)) {
        if ((chunks & 1023) == 1023 && orbit_cancelled(orbit)) return;
        #pragma unroll
        for (int step = 0; step < TURNS(CHUNK); ++step) {
            #pragma unroll
            for (int p = 0; p < TURNS(PACKETS); ++p) {
                z[p] = apply(n + step, z[p], c[p], k);
                square[p] = state_square(z[p]);
                alive[p] &= less_equal(square[p], farthest);
            }
        }
        n += CHUNK;
        open = ~all_lanes;
        ++chunks;
        #pragma unroll
        for (int p = 0; p < TURNS(PACKETS); ++p) {
#if LOGARITHMIC
            if (comparable) {
                periodic[p] |= alive[p] & equal(apart_square(z[p], past[p]), R(0.0)) & settled(square[p], orbit);
            }
            if (chunks == renewed) past[p] = z[p];
#endif
            open |= alive[p] & ~periodic[p];
        }
        if (chunks == renewed) {
            comparable = n >= REPEATS_FROM;
            renewed *= 2;
        }
    }
    if (any_lane(open)) {
        for (; n < limit; ++n) {
            #pragma unroll
            for (int p = 0; p < TURNS(PACKETS); ++p) {
                z[p] = apply(n, z[p], c[p], k);
                square[p] = state_square(z[p]);
                alive[p] &= less_equal(square[p], farthest);
            }
        }
    }
    #pragma unroll
    for (int p = 0; p < TURNS(PACKETS); ++p) inside[p] = periodic[p] | (alive[p] & settled(square[p], orbit));
}
#endif
