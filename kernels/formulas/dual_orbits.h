// Orbits over dual numbers: distance and gradient by the full Jacobian.
#include "formulas/packet_orbits.h"

// An orbit under way over dual numbers, with the full Jacobian J of the last z.
typedef struct {
    orbit_lanes lanes;
    dual_state z;
    real square_before;
} dual_orbit;

// Of the surface's gradient: the lanes whose orbit went on from `gradient_limit`, and what it was there.
typedef struct {
    mask left;
    vec gradient;
} dual_limit;

INLINE dual_limit dual_limit_none(mask active) { return (dual_limit){active & ~active, {R(0.0), R(0.0), R(0.0)}}; }

// Lanes that are `late` go on; the other active ones begin at their points. `c` is what their applications add.
// The first application of these orbits is the answer.
INLINE int dual_orbit_begin(dual_orbit *o, dual_state *c, vec point, mask active, mask late, orbit_record orbit, constants k) {
    dual_state z;
    dual_start(point, k, c, &z);
    const real square = dual_state_square(z);
    o->z = dual_state_pick(late, o->z, z);
    if (!LOGARITHMIC) o->square_before = pick(late, o->square_before, square);
    const int first = ORBIT_FIRST(z, active & ~late);
    orbit_lanes_begin(&o->lanes, square, first, late, active, orbit);
    return first;
}

INLINE void dual_orbit_apply(int usual, dual_orbit *o, int n, dual_state c, orbit_record orbit, constants k) {
    const dual_state next = dual_apply_by(usual, n, o->z, c, k);
    const mask alive = going_on(o->lanes.alive);
    o->z = dual_state_pick(alive, next, o->z);
    if (!LOGARITHMIC) o->square_before = pick(alive, o->lanes.square, o->square_before);
    lanes_applied(&o->lanes, dual_state_square(next), orbit);
}

// The surface of the solid is where |z| is the bailout after `iterations` applications, and its gradient is J^T z there. The last z of
// a place beside it may be some applications farther. By them space is stretched once more, and where it is stretched unevenly their level
// sets face elsewhere. So no gradient `of` the surface is that of a z after `gradient_limit`: see `dual_limit`.
INLINE void dual_orbit_run(int usual, dual_orbit *o, dual_state c, int first, mask active, int of, int carries, dual_limit *at_limit,
                           orbit_record orbit, constants k) {
    const uint begun = lanes_bits(active);
    for (int n = first; IS_WITHIN_LONGEST(n, orbit); ++n) {
        const int looks = of == OF_SURFACE && o->lanes.look == 0;
        const int goes_on = lanes_go_on(&o->lanes, begun, carries, orbit);
        if (looks) {
            const mask here = o->lanes.alive & equal_ints(o->lanes.count, (mask)(orbit->gradient_limit));
            at_limit->gradient = vec_pick(here, dual_state_gradient(o->z, IN_SCENE(R(1.0) / o->lanes.square)), at_limit->gradient);
            at_limit->left |= here;
        }
        if (!goes_on) return;
        dual_orbit_apply(usual, o, n, c, orbit, k);
    }
}

// Distance and gradient by J: g = |J^T z/|z||.
INLINE clearance dual_orbit_end(const dual_orbit *o, mask active, const dual_limit *at_limit, orbit_record orbit, constants k,
                                surface_point *surface) {
    mask inside = o->lanes.inside;
    const real count = to_reals(o->lanes.count);
    real distance;
    if (ENDS_BY_SHAPE) {
        // The last solid's distance in z, over how fast it changes per scene unit.
        const dual solid = dual_solid_distance(o->z, k);
        surface->gradient = vec_of(IN_SCENE(solid.dx), IN_SCENE(solid.dy), IN_SCENE(solid.dz));
        const real solid_growth = vec_dot(surface->gradient, surface->gradient);
        distance = most(R(0.0), solid.v * pick(less(R(0.0), solid_growth), R(1.0) / sqrt(solid_growth), R(0.0)));
        inside = active & less_equal(solid.v, R(0.0));
    } else {
        // J^T z / |z|^2: dividing by |z|^2 first keeps the squares within range.
        const vec relative = dual_state_gradient(o->z, IN_SCENE(R(1.0) / o->lanes.square));
        const real relative_square = vec_dot(relative, relative);
        surface->gradient = vec_pick(at_limit->left, at_limit->gradient, relative);
        distance = distance_from_growth(o->lanes.square, R(1.0) / sqrt(relative_square), count, orbit);
    }
    surface->own.square = o->lanes.square;
    surface->own.square_before = o->square_before;
    const real step = pick(inside, R(0.0), distance);
    return (clearance){step, {count, inside}, step};
}

// What the orbits of active lanes find out at their points. Lanes that are `late` go on with theirs; which ones still do afterwards is put
// down there: of them nothing is found yet. At most `carries` are left, and `at_limit` goes on with them.
INLINE clearance dual_orbit_by(int usual, dual_orbit *o, vec point, mask active, mask *late, int of, int carries, dual_limit *at_limit,
                               orbit_record orbit, constants k, surface_point *surface) {
    dual_state c;
    at_limit->left &= *late;
    const int first = dual_orbit_begin(o, &c, point, active, *late, orbit, k);
    dual_orbit_run(usual, o, c, first, active, of, carries, at_limit, orbit, k);
    *late = o->lanes.alive;
    return dual_orbit_end(o, active, at_limit, orbit, k, surface);
}

CALLED void other_dual_orbit(dual_orbit *o, const vec *point, const mask *active, mask *late, int of, int carries, dual_limit *at_limit,
                             clearance *found, surface_point *surface, orbit_record orbit, constants k) {
    *found = dual_orbit_by(0, o, *point, *active, late, of, carries, at_limit, orbit, k, surface);
}

#define USUAL_DUAL_ORBIT(usual) case usual: return dual_orbit_by(usual, o, point, active, late, of, carries, at_limit, orbit, k, surface);
INLINE clearance formula_dual_orbit(dual_orbit *o, vec point, mask active, mask *late, int of, int carries, dual_limit *at_limit,
                                    orbit_record orbit, constants k, surface_point *surface) {
    USUALLY(USUAL_DUAL_ORBIT)
    // What a call may write to stays in memory, also where it is not called: it is given copies.
    const vec at = point;
    const mask lanes = active;
    mask goes_on = *late;
    dual_orbit own = *o;
    dual_limit limit = *at_limit;
    clearance found;
    surface_point there = *surface;
    other_dual_orbit(&own, &at, &lanes, &goes_on, of, carries, &limit, &found, &there, orbit, k);
    *o = own;
    *at_limit = limit;
    *late = goes_on;
    *surface = there;
    return found;
}

INLINE clearance formula_dual_distance(vec point, mask active, int of, orbit_record orbit, constants k, surface_point *surface) {
    dual_orbit o = {0};
    mask late = active & ~active;
    dual_limit at_limit = dual_limit_none(active);
    return formula_dual_orbit(&o, point, active, &late, of, 0, &at_limit, orbit, k, surface);
}
