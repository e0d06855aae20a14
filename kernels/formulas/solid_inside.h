// Which points belong to a formula's solid, for many points at once.
//
// From the build: CYCLE, applications after which whose turn it is in a chain repeats itself; REPEATS_FROM, the one from which on it
// does.

// Applications between two looks at a packet: few cost time.
#define CHUNK 4

// Packets whose orbits are computed side by side, so that one goes on while another waits for a result. Where there is one
// lane, the device has other work-items for that.
#define PACKETS (LANES == 1 ? 1 : 2)

// The square of how far apart two states are, where orbits may come back.
INLINE real apart_square(state z, state past) {
    state apart;
#define APART(s) apart.s = z.s - past.s;
    STATE_EACH(APART)
    return state_square(apart);
}

// Which points belong to the solid: as `formula_end` at the iteration limit, in fewer operations. An orbit that comes back to
// the very same z never escapes (Brent 1980, "An improved Monte Carlo factorization algorithm", sec. 2: compare with a z that is
// renewed at powers of two). Packets are tested every few applications, and lanes that escaped continue without effect. One
// lane ends at once, and has neither arrays nor loops of a constant count (see TURNS in lanes.h).
#if LANES == 1
INLINE void orbits_inside(const vec *points, mask *inside, orbit_record orbit, constants k) {
    const real farthest = orbit->distance_square;
    const int limit = orbit->iterations;
    state c, z;
    start(points[0], k, &c, &z);
    state past = z;
    real square = state_square(z);
    mask alive = less_equal(square, farthest);
    const int first = ORBIT_FIRST(z, alive);
    int look = first + CHUNK, looks = 0, renewed = 1;
    // Equal states have equal futures only where the turns repeat.
    int kept = first, comparable = first >= REPEATS_FROM;
    for (int n = first; n < limit && alive; ++n) {
        z = apply(n, z, c, k);
        square = state_square(z);
        alive = less_equal(square, farthest);
        if (n + 1 < look) continue;
        look += CHUNK;
        if ((++looks & 1023) == 0 && orbit_cancelled(orbit)) break;
        if (!LOGARITHMIC) continue;
        if (comparable && (n + 1 - kept) % CYCLE == 0 && equal(apart_square(z, past), R(0.0)) && in_set(square, orbit)) break;
        if (looks == renewed) {
            past = z;
            renewed *= 2;
            kept = n + 1;
            comparable = kept >= REPEATS_FROM;
        }
    }
    inside[0] = alive & in_set(square, orbit);
}
#else
INLINE void orbits_inside(const vec *points, mask *inside, orbit_record orbit, constants k) {
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
    int n = ORBIT_FIRST(z[0], alive[0]), renewed = 1, chunks = 0;
    #pragma unroll
    for (int p = 1; p < TURNS(PACKETS); ++p) n = min(n, ORBIT_FIRST(z[p], alive[p]));
    int kept = n, comparable = n >= REPEATS_FROM;  // as above
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
            if (LOGARITHMIC && comparable && (n - kept) % CYCLE == 0) {
                periodic[p] |= alive[p] & equal(apart_square(z[p], past[p]), R(0.0)) & HAS_BEGUN(z[p]) & in_set(square[p], orbit);
            }
            if (LOGARITHMIC && chunks == renewed) past[p] = z[p];
            open |= alive[p] & ~periodic[p];
        }
        if (chunks == renewed) {
            kept = n;
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
    for (int p = 0; p < TURNS(PACKETS); ++p) inside[p] = periodic[p] | (alive[p] & in_set(square[p], orbit));
}
#endif

INLINE void formula_all_inside(const vec *points, mask *inside, orbit_record orbit, constants k) {
    if (!ENDS_BY_SHAPE) {
        orbits_inside(points, inside, orbit, k);
        return;
    }
    const mask all_lanes = equal(R(0.0), R(0.0));
    for (int p = 0; p < TURNS(PACKETS); ++p) inside[p] = formula_end(points[p], all_lanes, orbit->iterations, orbit, k).inside;
}

// As `solids_inside`: a formula is asked only where its ball is near.
INLINE void one_inside(const vec *points, mask *inside, orbit_record o, constants k) {
    vec own[PACKETS];
    for (int p = 0; p < TURNS(PACKETS); ++p) own[p] = solid_own(o, points[p]);
    if (o->kind != SOLID_FORMULA) {
        for (int p = 0; p < TURNS(PACKETS); ++p) inside[p] = simple_holds(o, own[p]);
        return;
    }
    const real radius = (R(1.0) + SOLID_NEAR) * (real)(o->ball_radius);
    mask near[PACKETS], any_near = less(R(1.0), R(0.0));
    for (int p = 0; p < TURNS(PACKETS); ++p) {
        const vec arm = vec_sub(points[p], vec_splat(o->ball));
        near[p] = less(vec_dot(arm, arm), radius * radius);
        inside[p] = less(R(1.0), R(0.0));
        any_near |= near[p];
    }
    if (!any_lane(any_near)) return;
    formula_all_inside(own, inside, o, k + o->first);
    for (int p = 0; p < TURNS(PACKETS); ++p) inside[p] &= near[p];
}

INLINE void solid_inside(const vec *points, mask *inside, orbit_record orbit, constants k) {
    if (!JOINED) {
        formula_all_inside(points, inside, orbit, k);
        return;
    }
    if (orbit->flows) {
        // Only their distances tell what is inside.
        for (int p = 0; p < TURNS(PACKETS); ++p) {
            surface_point ignored;
            inside[p] = solids_distance(points + p, equal(R(0.0), R(0.0)), ASK_STEP, orbit, k, &ignored).end.inside;
        }
        return;
    }
    one_inside(points, inside, orbit, k);
    for (int i = 1; i < orbit->solids; ++i) {
        mask more[PACKETS];
        one_inside(points, more, orbit + i, k);
        for (int p = 0; p < TURNS(PACKETS); ++p) inside[p] = inside_joined(orbit[i].join, inside[p], more[p]);
    }
}
