// How solids are joined: one more to all before it. 
//
// A cut is the larger of the one distance and of the other's negative, an intersection the larger of both (Hart 1996, "Sphere
// tracing").
//
// How deep a place is in a formula's set is not known. Where such a set is cut out it leaves a hollow, in which a distance lies between
// two bounds, that are folded as distances are: it is at least that to what was cut, and may be any.
NUMBERS_PICKED(surface_point)

// A number between those of both, as far as each has one.
INLINE real shared(real own, real other, mask own_known, mask other_known, real share) {
    return pick(own_known & other_known, own + share * (other - own), pick(other_known, other, own));
}

// The surface where `more` flows into all before it, whose part is `of_more`. Of three that meet in one place the two count which
// have the largest parts.
INLINE surface_point surface_flowing(surface_point all, surface_point more, mask closer, real of_more) {
    const real of_all = R(1.0) - of_more, first = of_all * (R(1.0) - all.share), second = of_all * all.share;
    const mask stays = ~closer & less(of_more, second);
    surface_point found = surface_point_pick(closer, more, all), beside = all;
    beside.other = more.own;
    found.other = all.own;
    found = surface_point_pick(closer, found, surface_point_pick(stays, all, beside));
    found.share = pick(stays, all.share, pick(closer, first, of_more) / (first + of_more));
    return found;
}

// Of two surfaces that of `more` where it `counts`. Where nothing flows no surface has another one beside it.
INLINE void surface_replace(orbit_record o, surface_point *all, mask counts, surface_point more) {
    real *numbers = (real *)all;
    for (int i = 0; i < SURFACE_ALONE; ++i) numbers[i] = pick(counts, ((const real *)&more)[i], numbers[i]);
    if (!o->flows) return;
    for (int i = SURFACE_ALONE; i < NUMBERS_OF(surface_point); ++i) numbers[i] = pick(counts, ((const real *)&more)[i], numbers[i]);
}

// In a hollow what is joined to it later counts as the nearest this near: a part of the radius of its ball.
#define HOLLOW_NEAR R(0.1)

INLINE mask in_hollow(solid_found found) { return less(found.far, found.most); }

// Cuts a formula's set out.
INLINE void solid_hollow(orbit_record o, solid_found *all, solid_found more) {
    const real all_of_it = (real)(REAL_LARGEST), wall = pick(more.inside, all_of_it, -more.far);
    more.surface.gradient = vec_scale(more.surface.gradient, R(-1.0));
    const mask counts = all->inside & less(all->far, wall);
    surface_replace(o, &all->surface, counts, more.surface);
    all->scale = pick(counts, more.scale, all->scale);
    all->far = most(all->far, pick(more.inside, R(0.0), -more.far));
    all->most = pick(more.inside, all_of_it, most(all->most, -more.far));
    all->near = pick(more.inside, all_of_it, most(all->near, -more.far));
    all->apart = all->far;
    all->inside &= ~more.inside;
}

// How near a solid has to be so that its surface is the nearest, not those before it.
INLINE real nearest_before(orbit_record o, const solid_found *all) {
    const scalar size = o->kind == SOLID_FORMULA ? o->ball_radius : fmax(fmax(o->sides[0], o->sides[1]), o->sides[2]);
    return pick(in_hollow(*all), least(all->most, HOLLOW_NEAR * (real)(size)), all->apart);
}

// All distances by one way to put two together.
#define FOLDED(JOIN)                              \
    all->far = JOIN(all->far, more.far);          \
    all->most = JOIN(all->most, more.far);        \
    all->near = JOIN(all->near, more.near);       \
    all->apart = JOIN(all->apart, more.apart);

// Leaves of solids what is in one more, too. `rounding`: what a place is not known better than.
INLINE void solid_bounded(orbit_record o, solid_found *all, solid_found more, real rounding) {
    // A place that a search has put on a wall may lie behind it by rounding: it is on the wall.
    const real wall = o->kind == SOLID_FORMULA ? R(0.0) : rounding;
    const mask counts = less(all->apart, more.apart + wall);
    // The wall of a simple solid is a part of what it cuts: its orbits are that formula's.
    if (o->kind != SOLID_FORMULA) {
        // It has a colour of its own, but the counts of both that flow together there.
        const real wall_of = more.surface.own.solid;
        more.surface.own = all->surface.own;
        more.surface.share = all->surface.share;
        more.surface.other = all->surface.other;
        more.surface.own.solid = more.surface.other.solid = wall_of;
    }
    surface_replace(o, &all->surface, counts, more.surface);
    all->scale = pick(counts, more.scale, all->scale);
    FOLDED(fmax)
    all->inside &= o->kind == SOLID_FORMULA ? more.inside : less(more.far, -wall);
}

// Of one solid what the planes leave that open it alone. Their faces are walls, with numbers of their own.
INLINE void solid_opened(orbit_record o, vec point, solid_found *one, real rounding) {
    for (int i = 0; i < o->planes; ++i) {
        orbit_record plane = o + o->first_plane + i;
        solid_found more = {R(0.0)};
        solid_simple(plane, solid_own(plane, point), &more);
        more.most = more.near = more.apart = more.far;
        more.scale = R(1.0);
        more.surface.own.solid = (real)((scalar)plane->object);
        solid_bounded(plane, one, more, rounding);
    }
}

// Of two solids in one place the one displaces the other whose body has the higher number: the surface belongs to it.
INLINE mask displaces(mask nearer, solid_found *all, solid_found more) {
    const mask both = all->inside & more.inside, higher = less(all->body, more.body), lower = less(more.body, all->body);
    all->body = pick(more.inside & (~all->inside | higher), more.body, all->body);
    return (nearer | (both & higher)) & ~(both & lower);
}

// Joins one more solid to those before it.
INLINE void solid_join(orbit_record o, solid_found *all, solid_found more, real rounding) {
    const int cuts = o->join == JOIN_CUT || o->join == JOIN_INTERSECTION;
    if (cuts && o->bare) more.surface.own.solid = all->surface.own.solid;
    if (o->join == JOIN_CUT && o->kind == SOLID_FORMULA) {
        solid_hollow(o, all, more);
        return;
    }
    if (o->join == JOIN_CUT) {
        more.far = more.near = more.apart = -more.far;
        more.surface.gradient = vec_scale(more.surface.gradient, R(-1.0));
    }
    if (cuts) {
        solid_bounded(o, all, more, rounding);
        return;
    }
    const mask nearer = displaces(less(more.apart, nearest_before(o, all)), all, more);
    if (o->join == JOIN_SMOOTH) {
        // The smooth minimum of Quilez, of distances as they are: between both, a quarter of the width is added at most.
        const real width = (real)(o->smoothness), a = all->far / all->scale, b = more.far / more.scale;
        const real share = most(R(0.0), width - fabs(a - b)) / width;
        const mask closer = less(b, a);
        const mask flows = less(R(0.0), share) & ~in_hollow(*all);
        const real others = R(0.5) * share, of_more = pick(closer, R(1.0) - others, others);
        const vec gradient = vec_along(vec_scale(all->surface.gradient, R(1.0) - of_more), of_more, more.surface.gradient);
        const real lower = least(a, b) - R(0.25) * width * share * share, scale = least(all->scale, more.scale);
        const surface_point flowing = surface_flowing(all->surface, more.surface, closer, of_more);
        all->surface = surface_point_pick(flows, flowing, surface_point_pick(nearer, more.surface, all->surface));
        all->surface.gradient = vec_pick(flows, gradient, all->surface.gradient);
#define FLOWING(a, b) pick(flows, lower * scale, least(a, b))
        FOLDED(FLOWING)
        all->scale = pick(flows, scale, pick(nearer, more.scale, all->scale));
        all->inside |= more.inside | (flows & less_equal(lower, R(0.0)));
        return;
    }
    surface_replace(o, &all->surface, nearer, more.surface);
    all->scale = pick(nearer, more.scale, all->scale);
    FOLDED(fmin)
    all->inside |= more.inside;
}
