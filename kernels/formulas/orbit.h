// Orbits of points under the formula, as one loop over a packet: escape counts, inside tests, distances and gradients.
//
// From the generated text: STATE_SIZE, state, dual_state, FIRST_COUNT (applications that the starting state already counts),
// LOGARITHMIC (the degree is above 1), HAS_DERIVATIVE, HAS_SHAPE, HAS_CALLS (of exp, sin and their like), start, dual_start, apply,
// apply_derivative and dual_apply (each also as ..._by), has_usual_values and its answers beside 0 (EACH_USUAL), state_pick,
// dual_state_pick, state_square, solid_distance.
// Of several formulas they are of the one whose constants are given, and what these do not have in common is read from its `orbit`.
//
// A lane's orbit runs until |z| exceeds the distance bailout. The solid is the set of points with |z| <= bailout after
// `iterations` applications; a lane that left the bailout by then but not yet the larger radius goes on a little longer.

#include "formulas/orbit_types.h"

// Distance to the solid from the last |z|, its count and the growth of |z| per scene unit, g = |J^T z / |z||, given relative
// to |z|: `relative` = |z| / g.
//
// Degree > 1: |z_n| grows like exp(G degree^n) with G the potential, so |z| log|z| / (2 g) is half of G / |grad G| (Hart,
// Sandin, Kauffman 1989; the half makes it a lower bound for conformal maps). The solid of `iterations` applications is the
// level set of G at L = log(bailout) / degree^iterations. The map of a half plane that bends space most, w -> w^2, has the
// distance (G^2 - L^2) / (2 G |grad G|). Far outside the distance is at most (1 - exp(-G)) / |grad G|, that of a ball.
INLINE real distance_from_growth(real square, real relative, real count, orbit_record orbit) {
    real distance;
    if (LOGARITHMIC) {
        const real height = R(0.34657359028) * quick_log2(square);  // half of log 2
        const real counts_left = (real)((scalar)orbit->iterations) - count;
        const real level = (real)(orbit->log_bailout) * quick_exp2(-counts_left * (real)(orbit->log2_degree)) / height;
        const real far = height * quick_exp2(-count * (real)(orbit->log2_degree));
        const real share = (R(1.0) - level * level) / (R(1.0) + far * (R(0.5) + R(0.0833333333) * far));
        distance = R(0.5) * height * relative * share;
    } else {
        distance = (R(1.0) - (real)(orbit->solid_radius) / sqrt(square)) * relative;
    }
    // An overflow of the derivative means that the surface is nearer than the number type can resolve.
    return fmax(pick(is_nan(distance), R(0.0), distance), R(0.0));
}

// Lanes that end the orbit inside at the iteration limit: true for those still within the bailout.
INLINE mask in_set(real square, orbit_record orbit) { return less_equal(square, (real)(orbit->bailout_square)); }

// What an orbit for a distance looks at after `look` applications: at the limit, which of its lanes are inside; before it, whether
// the work was cancelled, which is the result.
INLINE int orbit_look(int n, int *look, real square, mask *alive, mask *inside, orbit_record orbit) {
    if (n < orbit->iterations) {
        *look = min(n + ORBIT_LOOK, orbit->iterations);
        return orbit_cancelled(orbit);
    }
    *inside = *alive & in_set(square, orbit);
    *alive &= ~*inside;
    *look = INT_MAX;
    return 0;
}

// Escape counts with `bailout` alone: applications until |z| > bailout, at most `iterations`.
INLINE orbit_counted formula_escape_count(vec point, mask active, orbit_record orbit, constants k) {
    state c, z;
    start(point, k, &c, &z);
    real square = state_square(z);
    mask alive = active & less_equal(square, (real)(orbit->bailout_square));
    mask count = (active & ~active) + min(FIRST_COUNT, orbit->iterations);
    for (int n = FIRST_COUNT, look = ORBIT_LOOK; n < orbit->iterations; ++n) {
        if (!any_lane(alive)) break;
        if (n == look) {
            if (orbit_cancelled(orbit)) break;
            look += ORBIT_LOOK;
        }
        const state next = apply(n, z, c, k);
        z = state_pick(alive, next, z);
        square = pick(alive, state_square(next), square);
        count -= alive;  // true is -1
        alive &= less_equal(square, (real)(orbit->bailout_square));
    }
    return (orbit_counted){count, alive};
}

// Orbits are written for the `usual` values of a formula's exponents and conditions, which are literals then, and for any: a branch
// around the whole orbit, since what others call moves all registers into memory. Of several formulas each has an orbit of its own for
// its usual values, or branches within would move its state, too.
#define USUALLY(DO) switch (has_usual_values(k)) { EACH_USUAL(DO) }

// Which points belong to the solid of `limit` applications: the inside of the distances below, without the distance. The
// solids of fewer applications hold those of more (but for an orbit that comes back from beyond the distance bailout).
INLINE orbit_end end_by(int usual, vec point, mask active, int limit, orbit_record orbit, constants k) {
    state c, z;
    start(point, k, &c, &z);
    real square = state_square(z);
    real count = (real)((scalar)min(FIRST_COUNT, limit));
    mask alive = active & less_equal(square, (real)(orbit->distance_square));
    for (int n = FIRST_COUNT, look = ORBIT_LOOK; n < limit; ++n) {
        if (!any_lane(alive)) break;
        if (n == look) {
            if (orbit_cancelled(orbit)) break;
            look += ORBIT_LOOK;
        }
        const state next = apply_by(usual, n, z, c, k);
        z = state_pick(alive, next, z);
        square = pick(alive, state_square(next), square);
        count = pick(alive, (real)((scalar)(n + 1)), count);
        alive &= less_equal(square, (real)(orbit->distance_square));
    }
    alive = HAS_SHAPE ? active & less_equal(solid_distance(z, k), R(0.0)) : alive & in_set(square, orbit);
    return (orbit_end){count, alive};
}

#define USUAL_END(usual) case usual: return end_by(usual, point, active, limit, orbit, k);
INLINE orbit_end formula_end(vec point, mask active, int limit, orbit_record orbit, constants k) {
    USUALLY(USUAL_END)
    return end_by(0, point, active, limit, orbit, k);
}

// Distance and gradient by the full Jacobian J of the last z: g = |J^T z/|z||.
//
// The surface of the solid is where |z| is the bailout after `iterations` applications, and its gradient is J^T z there. The last z of
// a place beside it may be some applications farther. By them space is stretched once more, and where it is stretched unevenly their level
// sets face elsewhere. So no gradient `of` the surface is that of a z after `gradient_limit`.
INLINE clearance dual_distance_by(int usual, vec point, mask active, int of, orbit_record orbit,
                                  constants k, surface_point *surface) {
    dual_state c, z;
    dual_start(point, k, &c, &z);
    real square = dual_state_square(z);
    real square_before = square;
    real count = (real)((scalar)FIRST_COUNT);
    mask alive = active & less_equal(square, (real)(orbit->distance_square));
    mask inside = alive & ~alive, left = inside;
    vec at_limit = vec_of(R(0.0), R(0.0), R(0.0));
    for (int n = FIRST_COUNT, look = min(ORBIT_LOOK, orbit->iterations); n < orbit->longest; ++n) {
        if (n == look) {
            if (orbit_look(n, &look, square, &alive, &inside, orbit)) break;
            if (of == OF_SURFACE && n == orbit->gradient_limit) {
                left = alive;
                at_limit = dual_state_gradient(z, R(1.0) / square);
            }
        }
        if (!any_lane(alive)) break;
        const dual_state next = dual_apply_by(usual, n, z, c, k);
        z = dual_state_pick(alive, next, z);
        square_before = pick(alive, square, square_before);
        square = pick(alive, dual_state_square(next), square);
        count = pick(alive, (real)((scalar)(n + 1)), count);
        alive &= less_equal(square, (real)(orbit->distance_square));
    }
    if (orbit->longest <= orbit->iterations) inside |= alive & in_set(square, orbit);
    real distance;
    if (HAS_SHAPE) {
        // The last solid's distance in z, over how fast it changes per scene unit.
        const dual solid = dual_solid_distance(z, k);
        surface->gradient = vec_of(solid.dx, solid.dy, solid.dz);
        const real solid_growth = vec_dot(surface->gradient, surface->gradient);
        distance = fmax(solid.v * pick(less(R(0.0), solid_growth), R(1.0) / sqrt(solid_growth), R(0.0)), R(0.0));
        inside = active & less_equal(solid.v, R(0.0));
    } else {
        // J^T z / |z|^2: dividing by |z|^2 first keeps the squares within range.
        const vec relative = dual_state_gradient(z, R(1.0) / square);
        const real relative_square = vec_dot(relative, relative);
        surface->gradient = vec_pick(left, at_limit, relative);
        distance = distance_from_growth(square, R(1.0) / sqrt(relative_square), count, orbit);
    }
    surface->own.square = square;
    surface->own.square_before = square_before;
    const real step = pick(inside, R(0.0), distance);
    return (clearance){step, {count, inside}, step};
}

CALLED void other_dual_distance(const vec *point, const mask *active, int of, clearance *found, surface_point *surface,
                                orbit_record orbit, constants k) {
    *found = dual_distance_by(0, *point, *active, of, orbit, k, surface);
}

#define USUAL_DUAL_DISTANCE(usual) case usual: return dual_distance_by(usual, point, active, of, orbit, k, surface);
INLINE clearance formula_dual_distance(vec point, mask active, int of, orbit_record orbit, constants k, surface_point *surface) {
    USUALLY(USUAL_DUAL_DISTANCE)
    // What a call may write to stays in memory, also where it is not called: it is given copies.
    const vec at = point;
    const mask lanes = active;
    clearance found;
    surface_point own = *surface;
    other_dual_distance(&at, &lanes, of, &found, &own, orbit, k);
    *surface = own;
    return found;
}

// Smooth escape count: where between two applications |z| passed the distance bailout. Degree > 1 grows doubly exponentially
// (n + 1 - log(log|z| / log R) / log degree), degree 1 exponentially.
INLINE real formula_smooth_count(orbit_end end, orbit_result result, orbit_record orbit) {
    const real log_radius = (real)(orbit->log_distance_bailout);
    real over;
    if (LOGARITHMIC) over = log2(R(0.5) * log(fmax(result.square, R(1.0))) / log_radius) / (real)(orbit->log2_degree);
    else over = (R(0.5) * log(result.square) - log_radius) / (R(0.5) * log(result.square / result.square_before));
    const real smooth = end.count - pick(is_nan(over), R(0.0), clamp(over, R(0.0), R(1.0)));
    return pick(end.inside, (real)((scalar)orbit->iterations), smooth);
}

// The potential G = log|z_n| / degree^n, which falls towards the solid. Linear maps have none: 0, as near as can be.
INLINE real formula_potential(orbit_end end, orbit_result result, orbit_record orbit) {
    if (!LOGARITHMIC) return R(0.0);
    return R(0.34657359028) * quick_log2(result.square) * exp2(-end.count * (real)(orbit->log2_degree));
}

// The distance used for marching: the cheapest that the formula offers.
#if HAS_DERIVATIVE
// An orbit under way that carries the formula's own scalar derivative.
typedef struct {
    state c, z;
    real growth, square, count;
    mask alive, inside;
} scalar_orbit;

INLINE void scalar_orbit_begin(scalar_orbit *o, vec point, mask active, orbit_record orbit, constants k) {
    start(point, k, &o->c, &o->z);
    o->growth = R(1.0);
    o->square = state_square(o->z);
    o->count = (real)((scalar)FIRST_COUNT);
    o->alive = active & less_equal(o->square, (real)(orbit->distance_square));
    o->inside = o->alive & ~o->alive;
}

INLINE void scalar_orbit_apply(int usual, scalar_orbit *o, int n, orbit_record orbit, constants k) {
    real next_growth = o->growth;
    const state next = apply_derivative_by(usual, n, o->z, o->c, &next_growth, k);
    o->z = state_pick(o->alive, next, o->z);
    o->growth = pick(o->alive, next_growth, o->growth);
    o->square = pick(o->alive, state_square(next), o->square);
    o->count = pick(o->alive, (real)((scalar)(n + 1)), o->count);
    o->alive &= less_equal(o->square, (real)(orbit->distance_square));
}

// The distance by this derivative: |z| / g with g carried as one number.
INLINE clearance scalar_orbit_end(const scalar_orbit *o, mask active, orbit_record orbit, constants k) {
    mask inside = o->inside;
    if (orbit->longest <= orbit->iterations) inside |= o->alive & in_set(o->square, orbit);
    real distance;
    if (HAS_SHAPE) {
        const real solid = solid_distance(o->z, k);
        distance = fmax(solid / o->growth, R(0.0));
        inside = active & less_equal(solid, R(0.0));
    } else {
        distance = distance_from_growth(o->square, sqrt(o->square) / o->growth, o->count, orbit);
    }
    const real step = pick(inside, R(0.0), distance);
    return (clearance){step, {o->count, inside}, step};
}

INLINE clearance scalar_distance_by(int usual, vec point, mask active, orbit_record orbit, constants k) {
    scalar_orbit o;
    scalar_orbit_begin(&o, point, active, orbit, k);
    for (int n = FIRST_COUNT, look = min(ORBIT_LOOK, orbit->iterations); n < orbit->longest; ++n) {
        if (n == look && orbit_look(n, &look, o.square, &o.alive, &o.inside, orbit)) break;
        if (!any_lane(o.alive)) break;
        scalar_orbit_apply(usual, &o, n, orbit, k);
    }
    return scalar_orbit_end(&o, active, orbit, k);
}

#define USUAL_DISTANCE(usual) case usual: return scalar_distance_by(usual, point, active, orbit, k);
INLINE clearance formula_distance(vec point, mask active, orbit_record orbit, constants k) {
    USUALLY(USUAL_DISTANCE)
    return scalar_distance_by(0, point, active, orbit, k);
}

// The same of two packets side by side: an application is a chain of operations that wait for each other, and the processor works
// on the other packet's meanwhile.
INLINE void scalar_distances_by(int usual, const vec *points, const mask *active, clearance *found,
                                orbit_record orbit, constants k) {
    scalar_orbit a, b;
    scalar_orbit_begin(&a, points[0], active[0], orbit, k);
    scalar_orbit_begin(&b, points[1], active[1], orbit, k);
    for (int n = FIRST_COUNT, look = min(ORBIT_LOOK, orbit->iterations); n < orbit->longest; ++n) {
        int next_look = look;
        if (n == look && (orbit_look(n, &next_look, a.square, &a.alive, &a.inside, orbit) |
                          orbit_look(n, &look, b.square, &b.alive, &b.inside, orbit))) break;
        // One of them may go on for long.
        const int first = any_lane(a.alive), second = any_lane(b.alive);
        if (!(first | second)) break;
        if (first) scalar_orbit_apply(usual, &a, n, orbit, k);
        if (second) scalar_orbit_apply(usual, &b, n, orbit, k);
    }
    found[0] = scalar_orbit_end(&a, active[0], orbit, k);
    found[1] = scalar_orbit_end(&b, active[1], orbit, k);
}

CALLED void other_scalar_distances(const vec *points, const mask *active, clearance *found, orbit_record orbit, constants k) {
    scalar_distances_by(0, points, active, found, orbit, k);
}

#define USUAL_DISTANCES(usual) case usual: scalar_distances_by(usual, points, active, found, orbit, k); return;
INLINE void formula_distances(const vec *points, const mask *active, clearance *found, orbit_record orbit, constants k) {
    USUALLY(USUAL_DISTANCES)
    other_scalar_distances(points, active, found, orbit, k);
}
#else
INLINE clearance formula_distance(vec point, mask active, orbit_record orbit, constants k) {
    surface_point ignored;
    return formula_dual_distance(point, active, OF_DISTANCE, orbit, k, &ignored);
}

INLINE void formula_distances(const vec *points, const mask *active, clearance *found, orbit_record orbit, constants k) {
    for (int i = 0; i < 2; ++i) found[i] = formula_distance(points[i], active[i], orbit, k);
}
#endif
