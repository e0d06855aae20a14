// What is proved of several solids that are joined in a whole node of the octree: in the place of `node_proof.h`, whose
// functions each text of a formula has with its number behind their names.

// How far a place is at least from one solid; below 0 how deep it is at least in a simple one. Distances of formulas are made
// for the inside of their balls.
INLINE real one_distance(vec point, real reach, __constant const struct Orbit *o, __constant const scalar *k) {
    const vec own = solid_own(o, point);
    if (o->kind != SOLID_FORMULA) {
        solid_found found;
        solid_simple(o, own, &found);
        return found.far;
    }
    const vec arm = vec_sub(point, vec_splat(o->ball));
    const real beyond = sqrt(vec_dot(arm, arm)) - (R(1.0) + SOLID_NEAR) * (real)(o->ball_radius);
    const mask within = less_equal(beyond, R(0.0));
    if (!any_lane(within)) return beyond;
    const real scale = (real)(o->scale / o->step_scale);
    real found = R(0.0);
#define DISTANCE_TEXT(i) case i: found = node_distance_##i(own, reach / scale, o, k + o->first); break;
    switch (o->text) { EACH_TEXT(DISTANCE_TEXT) }
    return pick(within, found * scale * (real)(fmin(o->step_scale, S(1.0))), beyond);
}

INLINE real node_distance(vec point, real reach, __constant const struct Orbit *orbit, __constant const scalar *k) {
    real all = one_distance(point, reach, orbit, k);
    for (int i = 1; i < SOLIDS; ++i) {
        __constant const struct Orbit *o = orbit + i;
        const real more = one_distance(point, reach, o, k);
        if (o->join == JOIN_CUT) all = fmax(all, -more);
        else if (o->join == JOIN_INTERSECTION) all = fmax(all, more);
        // What flows together grows by a quarter of the width, in distances that may be half of the true ones.
        else all = fmin(all, more) - (o->join == JOIN_SMOOTH ? (real)(o->smoothness) : R(0.0));
    }
    return all;
}

// Which nodes lie in one solid as a whole; `outside`: which beside it, of what is cut out.
INLINE mask one_holds(vec middle, vec half_side, mask candidates, mask *outside, __constant const struct Orbit *o,
                      __constant const scalar *k) {
    const vec own = solid_own(o, middle);
    const real reach = sqrt(vec_dot(half_side, half_side));
    if (o->kind != SOLID_FORMULA) {
        solid_found found;
        solid_simple(o, own, &found);
        *outside = less(reach, found.far);
        return candidates & less(found.far, -reach);
    }
    // The box along the formula's own axes around the node.
    const vec x = vec_splat(o->own_x), y = vec_splat(o->own_y), z = vec_splat(o->own_z);
#define HALF_ALONG(a) (fabs(a.x) * half_side.x + fabs(a.y) * half_side.y + fabs(a.z) * half_side.z)
    const vec own_half = vec_of(HALF_ALONG(x), HALF_ALONG(y), HALF_ALONG(z));
    const vec arm = vec_sub(middle, vec_splat(o->ball));
    mask held = candidates & less(sqrt(vec_dot(arm, arm)) + reach, (real)(o->ball_radius));
    *outside = candidates & ~candidates;
    if (o->join == JOIN_CUT) *outside = candidates & less(reach, one_distance(middle, reach, o, k));
    if (!any_lane(held)) return held;
#define HOLDS_TEXT(i) case i: held = node_inside_##i(own, own_half, held, o, k + o->first); break;
    switch (o->text) { EACH_TEXT(HOLDS_TEXT) }
    return held;
}

INLINE mask node_inside(vec middle, vec half_side, mask candidates, __constant const struct Orbit *orbit,
                        __constant const scalar *k) {
    mask beside, all = one_holds(middle, half_side, candidates, &beside, orbit, k);
    for (int i = 1; i < SOLIDS; ++i) {
        const int join = orbit[i].join;
        const mask more = one_holds(middle, half_side, candidates, &beside, orbit + i, k);
        if (join == JOIN_CUT) all &= beside;
        else if (join == JOIN_INTERSECTION) all &= more;
        else all |= more;
    }
    return all;
}
