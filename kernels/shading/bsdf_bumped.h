// How a material scatters light whose normal is not the surface's own: as by that normal, but light that would go below the surface, or
// that of its inner side above it, is mirrored by the surface (an ideal mirror, so nothing is lost). Towards the horizon, where the normal
// leans to, diffuse light fades as by Chiang, Li and Burley 2019 ("Taming the shadow terminator"), and what is taken there goes to the other
// side: it is mirrored by a wall across the way in which the normal leans, as the specular tangent facet of Schuessler and others 2017
// ("Microfacet-based normal mapping for robust Monte Carlo path tracing") does. Highlights do not fade, or they would come back as sparks;
// wide ones do in part, by the square of their alpha. All these are mirror images of directions: what a material reflects in all stays, and
// values and densities change alike.
// The material of a relief, `b`, on the surface with that normal.
INLINE void bsdf_lean(bsdf *b, vec surface) {
    b->relief = 1;
    b->surface = surface;
    b->level = vec_dot(b->normal, surface);
    // Any direction along the surface where the normal does not lean.
    const vec level = vec_sub(b->normal, vec_scale(surface, b->level));
    const mask leans = less(R(1e-12), vec_dot(level, level));
    vec side, up;
    make_frame(surface, &side, &up);
    b->leans = vec_pick(leans, vec_normalize(level), side);
}

INLINE vec mirrored_across(vec a, vec normal) { return vec_along(a, R(-2.0) * vec_dot(a, normal), normal); }

// The part of diffuse light that keeps its direction, one above the surface.
INLINE real horizon_share(const bsdf *b, vec toward) {
    const real over = vec_dot(toward, b->surface), facing = vec_dot(toward, b->normal) * b->level;
    const mask near = less(over, facing) & less(R(0.0), over);
    const real share = pick(near, over / pick(near, facing, R(1.0)), R(1.0));
    return share * (R(1.0) + share * (R(1.0) - share));
}

// Whether a direction is on the same side of the surface as it is by the leaning normal.
INLINE mask same_side(real a, real b) { return less(R(0.0), a * b); }

// f * cosine, and the probability per steradian of `scatter_sample`.
CALLED void scatter_value(const bsdf *b, const vec *direction, __global const float *tables, color *value, real *density) {
    const vec toward = *direction;
    const real over = vec_dot(toward, b->surface), none = R(0.0);
    mask across = less(R(1.0), none);
    vec leaning = toward;
    real stays = R(1.0), comes = none;
    if (b->relief) {
        const mask above = less(none, over);
        across = above & less(vec_dot(toward, b->leans), none);
        leaning = vec_pick(across, mirrored_across(toward, b->leans), toward);
        stays = pick(above, horizon_share(b, leaning), R(1.0));
        comes = pick(across, R(1.0) - stays, stays);
    }
    *value = color_of(none, none, none);
    *density = none;
    // What leaves in a direction came in it, or from its image below the surface; or was mirrored by the wall.
    for (int i = 0; i < (b->relief ? 3 : 1); ++i) {
        const vec from = i == 0 ? toward : i == 1 ? mirrored_across(leaning, b->surface) : leaning;
        const real broad = i == 0 ? pick(across, R(1.0), stays) : i == 1 ? comes : pick(across, comes, none);
        const real sharp = i == 0 ? R(1.0) : i == 1 ? pick(across, none, R(1.0)) : none;
        const mask counts = same_side(vec_dot(from, b->normal), over) & less(none, broad + sharp);
        if (!any_lane(counts)) continue;
        *value = color_pick(counts, color_add(*value, bsdf_parts(b, from, broad, sharp, tables)), *value);
        *density = pick(counts, *density + bsdf_densities(b, from, broad, sharp), *density);
    }
}

// Where a direction goes that the leaning normal's material has chosen.
INLINE vec bumped_direction(const bsdf *b, vec toward, real choice, real wall) {
    const mask apart = ~same_side(vec_dot(toward, b->normal), vec_dot(toward, b->surface));
    toward = vec_pick(apart, mirrored_across(toward, b->surface), toward);
    real fades = pick(less(choice, b->by_coat + b->by_gloss), b->facets.alpha * b->facets.alpha, R(1.0));
    fades = pick(less(choice, b->by_coat), b->coat_facets.alpha * b->coat_facets.alpha, fades);
    const real before = b->by_coat + b->by_gloss;
    fades = pick(less_equal(before, choice) & less(choice, before + b->by_glass + b->by_beyond), R(0.0), fades);
    const mask leans = less(R(0.0), vec_dot(toward, b->surface)) & less(R(0.0), vec_dot(toward, b->leans));
    const mask moves = leans & less(wall, fades * (R(1.0) - horizon_share(b, toward)));
    return vec_pick(moves, mirrored_across(toward, b->leans), toward);
}

// A direction chosen by four numbers in (0, 1); 0 where there is none.
INLINE vec scatter_sample(const bsdf *b, real choice, real u, real v, real wall) {
    mask usable;
    vec toward = bsdf_sample(b, choice, u, v, &usable);
    if (b->relief) toward = bumped_direction(b, toward, choice, wall);
    return vec_pick(usable, toward, vec_of(R(0.0), R(0.0), R(0.0)));
}
