// How solids are joined: one more to all before it. From the build: JOINS_SMOOTHLY; HOLLOWS, whether a formula is cut out.
//
// A cut is the larger of the one distance and of the other's negative, an intersection the larger of both (Hart 1996, "Sphere
// tracing").
//
// How deep a place is in a formula's set is not known. Where such a set is cut out it leaves a hollow, in which a distance lies between
// two bounds, that are folded as distances are: it is at least that to what was cut, and may be any.
INLINE surface_point surface_pick(mask m, surface_point yes, surface_point no) {
    surface_point s;
    for (int i = 0; i < NUMBERS_OF(surface_point); ++i) ((real *)&s)[i] = pick(m, ((const real *)&yes)[i], ((const real *)&no)[i]);
    return s;
}

#if HOLLOWS
// In a hollow what is joined to it later counts as the nearest this near: a part of the radius of its ball.
#define HOLLOW_NEAR R(0.1)

INLINE mask in_hollow(solid_found found) { return less(found.far, found.most); }

// Cuts a formula's set out.
INLINE void solid_hollow(solid_found *all, solid_found more) {
    const real all_of_it = (real)(REAL_LARGEST), wall = pick(more.inside, all_of_it, -more.far);
    more.surface.gradient = vec_scale(more.surface.gradient, R(-1.0));
    const mask counts = all->inside & less(all->far, wall);
    all->surface = surface_pick(counts, more.surface, all->surface);
    all->scale = pick(counts, more.scale, all->scale);
    all->far = fmax(all->far, pick(more.inside, R(0.0), -more.far));
    all->most = pick(more.inside, all_of_it, fmax(all->most, -more.far));
    all->inside &= ~more.inside;
}
#endif

// How near a solid has to be so that its surface is the nearest, not those before it.
INLINE real nearest_before(__constant const struct Orbit *o, const solid_found *all) {
#if HOLLOWS
    const scalar size = o->kind == SOLID_FORMULA ? o->ball_radius : fmax(fmax(o->sides[0], o->sides[1]), o->sides[2]);
    return pick(in_hollow(*all), fmin(all->most, HOLLOW_NEAR * (real)(size)), all->far);
#else
    return all->far;
#endif
}

// Joins one more solid to those before it. `rounding`: what a place is not known better than.
INLINE void solid_join(__constant const struct Orbit *o, solid_found *all, solid_found more, real rounding) {
#if HOLLOWS
    if (o->join == JOIN_CUT && o->kind == SOLID_FORMULA) {
        solid_hollow(all, more);
        return;
    }
#endif
    if (o->join == JOIN_CUT) {
        more.far = -more.far;
        more.surface.gradient = vec_scale(more.surface.gradient, R(-1.0));
    }
    if (o->join == JOIN_CUT || o->join == JOIN_INTERSECTION) {
        // A place that a search has put on a wall may lie behind it by rounding: it is on the wall.
        const real wall = o->kind == SOLID_FORMULA ? R(0.0) : rounding;
        const mask counts = less(all->far, more.far + wall);
        // The wall of a simple solid is a part of what it cuts: its orbits are that formula's.
        if (o->kind != SOLID_FORMULA) {
            more.surface.square = all->surface.square;
            more.surface.square_before = all->surface.square_before;
            more.surface.count = all->surface.count;
            more.surface.of = all->surface.of;
        }
        all->surface = surface_pick(counts, more.surface, all->surface);
        all->scale = pick(counts, more.scale, all->scale);
        all->far = fmax(all->far, more.far);
        all->most = fmax(all->most, more.far);
        all->inside &= o->kind == SOLID_FORMULA ? more.inside : less(more.far, -wall);
        return;
    }
    const mask nearer = less(more.far, nearest_before(o, all));
#if JOINS_SMOOTHLY
    if (o->join == JOIN_SMOOTH) {
        // The smooth minimum of Quilez, of distances as they are: between both, a quarter of the width is added at most.
        const real width = (real)(o->smoothness), a = all->far / all->scale, b = more.far / more.scale;
        const real share = fmax(width - fabs(a - b), R(0.0)) / width;
        const mask closer = less(b, a);
        mask flows = less(R(0.0), share);
#if HOLLOWS
        flows &= ~in_hollow(*all);
#endif
        const real others = R(0.5) * share, of_more = pick(closer, R(1.0) - others, others);
        const vec gradient = vec_along(vec_scale(all->surface.gradient, R(1.0) - of_more), of_more, more.surface.gradient);
        const real lower = fmin(a, b) - R(0.25) * width * share * share, scale = fmin(all->scale, more.scale);
        const mask other = (flows & closer) | (~flows & nearer);
        all->surface = surface_pick(other, more.surface, all->surface);
        all->surface.gradient = vec_pick(flows, gradient, all->surface.gradient);
        all->far = pick(flows, lower * scale, fmin(all->far, more.far));
        all->most = pick(flows, all->far, fmin(all->most, more.far));
        all->scale = pick(flows, scale, pick(nearer, more.scale, all->scale));
        all->inside |= more.inside | (flows & less_equal(lower, R(0.0)));
        return;
    }
#endif
    all->surface = surface_pick(nearer, more.surface, all->surface);
    all->scale = pick(nearer, more.scale, all->scale);
    all->far = fmin(all->far, more.far);
    all->most = fmin(all->most, more.far);
    all->inside |= more.inside;
}
