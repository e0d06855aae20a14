// What is proved of a formula's solid in a whole node of the octree: that it is not there, or all of the node.

// How far a full node's image may bend, over its size. At 0.15 no voxel of 30 grids is wrong, at 0.4 many of some are.
#define BEND S(0.1)

// A node whose image, of radius r, comes near 0 in z: there a map of a degree above 1 has hardly any slope, as its middle
// tells, but it has elsewhere in the node, and the distance would be too large.
INLINE mask doubtful(real square, real radius_square, orbit_record orbit) {
    if (!LOGARITHMIC) return less(R(1.0), R(0.0));
    return less(R(0.25) * square, radius_square) & less(square, R(4.0));
}

#if STATE_SIZE == 4
#define STATE_DOT(a, b) (z.s0.a * z.s0.b + z.s1.a * z.s1.b + z.s2.a * z.s2.b + z.s3.a * z.s3.b)
#else
#define STATE_DOT(a, b) (z.s0.a * z.s0.b + z.s1.a * z.s1.b + z.s2.a * z.s2.b)
#endif

// The distance as `formula_distance` finds it, but the growth is that in any direction. The growth of |z| alone may vanish by
// chance: a ray that steps too far is told so by its next step, a node by nothing.
INLINE real formula_node_distance(vec point, real reach, orbit_record orbit, constants k) {
    if (HAS_SHAPE) return formula_distance(point, equal(R(0.0), R(0.0)), orbit, k).step;
#if HAS_DERIVATIVE
    state c, z;
    start(point, k, &c, &z);
    real growth = START_GROWTH(point), square = state_square(z);
#else
    dual_state c, z;
    dual_start(point, k, &c, &z);
    real square = dual_state_square(z);
#endif
    const real own_reach = IN_SCENE(reach);
    const int first = ORBIT_FIRST(z, equal(R(0.0), R(0.0)));
    real count = (real)((scalar)first);
    mask alive = less_equal(square, (real)(orbit->distance_square));
    mask near = alive & ~alive;
    for (int n = first; n < orbit->longest; ++n) {
        if (n % ORBIT_LOOK == ORBIT_LOOK - 1 && orbit_cancelled(orbit)) break;
        if (n == orbit->iterations) near |= alive & in_set(square, orbit);
#if HAS_DERIVATIVE
        near |= alive & doubtful(square, (own_reach * growth) * (own_reach * growth), orbit);
#else
        near |= alive & doubtful(square, own_reach * own_reach * (STATE_DOT(dx, dx) + STATE_DOT(dy, dy) + STATE_DOT(dz, dz)), orbit);
#endif
        alive &= ~near;
        if (!any_lane(alive)) break;
        const mask applied = going_on(alive);
#if HAS_DERIVATIVE
        real next_growth = growth;
        const state next = apply_derivative(n, z, c, &next_growth, k);
        z = state_pick(applied, next, z);
        growth = pick(applied, next_growth, growth);
        square = pick(applied, state_square(next), square);
#else
        const dual_state next = dual_apply(n, z, c, k);
        z = dual_state_pick(applied, next, z);
        square = pick(applied, dual_state_square(next), square);
#endif
        count = pick(applied, (real)((scalar)(n + 1)), count);
        alive = applied & less_equal(square, (real)(orbit->distance_square));
    }
    if (orbit->longest <= orbit->iterations) near |= alive & in_set(square, orbit);
#if !HAS_DERIVATIVE
    // The root of the largest sum of a row of |J^T J| is no less than J's largest singular value, and equal to it where the
    // map is conformal.
    const real xx = STATE_DOT(dx, dx), yy = STATE_DOT(dy, dy), zz = STATE_DOT(dz, dz);
    const real xy = fabs(STATE_DOT(dx, dy)), yz = fabs(STATE_DOT(dy, dz)), zx = fabs(STATE_DOT(dz, dx));
    const real growth = sqrt(fmax(fmax(xx + xy + zx, yy + xy + yz), zz + yz + zx));
#endif
    const real distance = distance_from_growth(square, sqrt(square) / IN_SCENE(growth), count, orbit);
    return pick(near, R(0.0), distance);
}

#define CORNERS 8
// One lane keeps its corners in registers, whose places the compiler has to know. Those of packets do not fit there.
#if LANES == 1
#define UNROLLED_ALONE _Pragma("unroll")
#else
#define UNROLLED_ALONE
#endif

INLINE real halved_difference_square(state a, state b) {
    state d;
#define HALVED_DIFFERENCE(s) d.s = R(0.5) * (a.s - b.s);
    STATE_EACH(HALVED_DIFFERENCE)
    return state_square(d);
}
INLINE real bend_square(state a, state b, state middle) {
    state d;
#define BEND_OF(s) d.s = R(0.5) * (a.s + b.s) - middle.s;
    STATE_EACH(BEND_OF)
    return state_square(d);
}

// Whether all of a node's orbits have begun.
INLINE mask node_begun(const state *z) {
    mask begun = HAS_BEGUN(z[CORNERS]);
    UNROLLED_ALONE
    for (int i = 0; i < TURNS(CORNERS); ++i) begun &= HAS_BEGUN(z[i]);
    return begun;
}

// A node is inside as a whole if, after every application, its image in z is near to a parallelepiped, as its corners and its
// middle tell, and twice its size around the middle's is within the bailout. Where the dynamics contract, that image shrinks;
// at the edge of a region of contraction it bends (for analytic maps by r/d, d the distance to the edge: Koebe's theorem).
INLINE mask formula_node_inside(vec middle, vec half_side, mask candidates, orbit_record orbit, constants k) {
    if (!LOGARITHMIC || HAS_SHAPE || CARRIES_NUMBERS) return candidates & ~candidates;
    state c[CORNERS + 1], z[CORNERS + 1];
    UNROLLED_ALONE
    for (int i = 0; i < TURNS(CORNERS); ++i) {
        const vec corner = vec_of(middle.x + ((i & 1) != 0 ? half_side.x : -half_side.x),
                                  middle.y + ((i & 2) != 0 ? half_side.y : -half_side.y),
                                  middle.z + ((i & 4) != 0 ? half_side.z : -half_side.z));
        start(corner, k, &c[i], &z[i]);
    }
    start(middle, k, &c[CORNERS], &z[CORNERS]);
    mask alive = candidates;
    int first = ORBIT_FIRST(z[CORNERS], candidates);
    UNROLLED_ALONE
    for (int i = 0; i < TURNS(CORNERS); ++i) first = min(first, ORBIT_FIRST(z[i], candidates));
    for (int n = min(first, orbit->iterations);; ++n) {
        real spread = R(0.0), bend = R(0.0);
        UNROLLED_ALONE
        for (int i = 0; i < TURNS(CORNERS / 2); ++i) {
            spread = fmax(spread, halved_difference_square(z[i], z[CORNERS - 1 - i]));
            bend = fmax(bend, bend_square(z[i], z[CORNERS - 1 - i], z[CORNERS]));
        }
        // (|m| + 2 s)^2 <= 2 m^2 + 8 s^2
        const real reach = R(2.0) * state_square(z[CORNERS]) + R(8.0) * spread;
        // Until they begin orbits are together, near one that is within the bailout.
        const mask waits = ~node_begun(z);
        alive &= waits | less_equal(reach, (real)(orbit->bailout_square));
        alive &= waits | less_equal(bend, (real)(BEND * BEND) * spread + R(1e-10));
        if (n >= orbit->iterations || !any_lane(alive)) break;
        UNROLLED_ALONE
        for (int i = 0; i < TURNS(CORNERS + 1); ++i) z[i] = apply(n, z[i], c[i], k);
    }
    return alive;
}

// How far a place is at least from one solid; below 0 how deep it is at least in a simple one. Distances of formulas are made
// for the inside of their balls.
INLINE real one_distance(vec point, real reach, orbit_record o, constants k) {
    const vec own = solid_own(o, point);
    if (o->kind != SOLID_FORMULA) return simple_far(o, own);
    const vec arm = vec_sub(point, vec_splat(o->ball));
    const real beyond = sqrt(vec_dot(arm, arm)) - (R(1.0) + SOLID_NEAR) * (real)(o->ball_radius);
    const mask within = less_equal(beyond, R(0.0));
    if (!any_lane(within)) return beyond;
    const real scale = (real)(o->scale / o->step_scale);
    const real found = formula_node_distance(own, reach / scale, o, k + o->first);
    return pick(within, found * scale * (real)(fmin(o->step_scale, S(1.0))), beyond);
}

INLINE real node_distance(vec point, real reach, orbit_record orbit, constants k) {
    if (!JOINED) return formula_node_distance(point, reach, orbit, k);
    real all = one_distance(point, reach, orbit, k);
    for (int i = 1; i < orbit->solids; ++i) {
        orbit_record o = orbit + i;
        const real more = one_distance(point, reach, o, k);
        if (o->join == JOIN_CUT) all = fmax(all, -more);
        else if (o->join == JOIN_INTERSECTION) all = fmax(all, more);
        // What flows together grows by a quarter of the width, in distances that may be half of the true ones.
        else all = fmin(all, more) - (o->join == JOIN_SMOOTH ? (real)(o->smoothness) : R(0.0));
    }
    return all;
}

// Which nodes lie in one solid as a whole; `outside`: which beside it, of what is cut out.
INLINE mask one_holds(vec middle, vec half_side, mask candidates, mask *outside, orbit_record o, constants k) {
    const vec own = solid_own(o, middle);
    const real reach = sqrt(vec_dot(half_side, half_side));
    if (o->kind != SOLID_FORMULA) {
        const real far = simple_far(o, own);
        *outside = less(reach, far);
        return candidates & less(far, -reach);
    }
    // The box along the formula's own axes around the node.
    const vec x = vec_splat(o->own_x), y = vec_splat(o->own_y), z = vec_splat(o->own_z);
#define HALF_ALONG(a) (fabs(a.x) * half_side.x + fabs(a.y) * half_side.y + fabs(a.z) * half_side.z)
    const vec own_half = vec_of(HALF_ALONG(x), HALF_ALONG(y), HALF_ALONG(z));
    const vec arm = vec_sub(middle, vec_splat(o->ball));
    mask held = candidates & less(sqrt(vec_dot(arm, arm)) + reach, (real)(o->ball_radius));
    *outside = candidates & ~candidates;
    if (o->join == JOIN_CUT) *outside = candidates & less(reach, one_distance(middle, reach, o, k));
    return any_lane(held) ? formula_node_inside(own, own_half, held, o, k + o->first) : held;
}

INLINE mask node_inside(vec middle, vec half_side, mask candidates, orbit_record orbit, constants k) {
    if (!JOINED) return formula_node_inside(middle, half_side, candidates, orbit, k);
    mask beside, all = one_holds(middle, half_side, candidates, &beside, orbit, k);
    for (int i = 1; i < orbit->solids; ++i) {
        const mask more = one_holds(middle, half_side, candidates, &beside, orbit + i, k);
        all = inside_joined(orbit[i].join, all, orbit[i].join == JOIN_CUT ? ~beside : more);
    }
    return all;
}
