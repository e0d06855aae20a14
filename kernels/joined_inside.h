// Which points belong to several solids that are joined, for many points at once: in the place of `solid_inside.h`, whose
// functions each text of a formula has with its number behind their names.

#if JOINS_SMOOTHLY
// Where solids flow together only their distances tell what is inside.
INLINE void solid_inside(const vec *points, mask *inside, __constant const struct Orbit *orbit, __constant const scalar *k) {
    for (int p = 0; p < TURNS(PACKETS); ++p) {
        surface_point ignored;
        inside[p] = solids_distance(points + p, equal(R(0.0), R(0.0)), ASK_STEP, orbit, k, &ignored).end.inside;
    }
}
#else
// As `solids_inside`: a formula is asked only where its ball is near.
INLINE void one_inside(const vec *points, mask *inside, __constant const struct Orbit *o, __constant const scalar *k) {
    vec own[PACKETS];
    for (int p = 0; p < TURNS(PACKETS); ++p) own[p] = solid_own(o, points[p]);
    if (o->kind != SOLID_FORMULA) {
        for (int p = 0; p < TURNS(PACKETS); ++p) {
            solid_found found;
            solid_simple(o, own[p], &found);
            inside[p] = found.inside;
        }
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
#define INSIDE_TEXT(i) case i: solid_inside_##i(own, inside, o, k + o->first); break;
    switch (o->text) { EACH_TEXT(INSIDE_TEXT) }
    for (int p = 0; p < TURNS(PACKETS); ++p) inside[p] &= near[p];
}

INLINE void solid_inside(const vec *points, mask *inside, __constant const struct Orbit *orbit, __constant const scalar *k) {
    one_inside(points, inside, orbit, k);
    for (int i = 1; i < SOLIDS; ++i) {
        mask more[PACKETS];
        one_inside(points, more, orbit + i, k);
        const int join = orbit[i].join;
        for (int p = 0; p < TURNS(PACKETS); ++p) {
            if (join == JOIN_CUT) inside[p] &= ~more[p];
            else if (join == JOIN_INTERSECTION) inside[p] &= more[p];
            else inside[p] |= more[p];
        }
    }
}
#endif
