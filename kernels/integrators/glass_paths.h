// Paths through glass: what they carry while they are inside, and how they get there.
// A place in the spectrum: the index of refraction there (`bend`, see `docs/tables_glass.py`), and what it weighs.
INLINE color spectrum_at(real place, real *bend, __global const float *table) {
    scalar x[LANES], found[4 * LANES];
    lanes_store(place * (real)((scalar)SPECTRUM_PLACES), x);
    for (int lane = 0; lane < LANES; ++lane) {
        const int i = clamp((int)x[lane], 0, SPECTRUM_PLACES - 1);
        const scalar on = x[lane] - (scalar)i;
        __global const float *low = table + 4 * i;
        for (int n = 0; n < 4; ++n) found[n * LANES + lane] = mix((scalar)low[n], (scalar)low[n + 4], on);
    }
    *bend = lanes_load(found);
    return color_of(lanes_load(found + LANES), lanes_load(found + 2 * LANES), lanes_load(found + 3 * LANES));
}

#define SAME_INDEX R(1e-5)   // what indices may differ by that are equal: light is bent less than numbers tell

// The material as a path meets it, from inside or not: for glass that spreads colours, at the path's wavelength, or at one that it
// takes if it is refracted now, `wave` in (0, 1), which then is the path's; the result is what it weighs then. The index by Cauchy's
// equation n = a + b / wavelength^2, and over that of the glass around. Between glasses of one index there is no boundary.
INLINE color glass_met(const path_state *with, border *edge, pbr *p, real *wave, world w) {
    const color white = color_of(R(1.0), R(1.0), R(1.0));
    p->inside = number_of(edge->leaving);
    const mask spreads = less(R(0.0), p->transmission_weight * p->transmission_dispersion_scale) & ~edge->hidden;
    const mask fresh = spreads & less(with->wave, R(0.0));
    *wave = pick(fresh, *wave, with->wave);
    color weights = white;
    if (any_lane(spreads)) {
        real bend;
        weights = color_pick(fresh, spectrum_at(fmax(*wave, R(0.0)), &bend, w.albedos + SPECTRUM), white);
        const real spread = p->transmission_dispersion_scale / p->transmission_dispersion_abbe_number;
        const real index = p->specular_ior + (p->specular_ior - R(1.0)) * spread * bend;
        p->bending_ior = pick(spreads, fmax(index, R(1.0)), p->specular_ior);
        // A path of all colours is reflected like their mean, so that those which are refracted are white together.
        p->specular_ior = pick(fresh, p->specular_ior, p->bending_ior);
    }
    const mask other = edge->glass & ~edge->hidden & ~equal(edge->inner, edge->body);
    if (any_lane(other)) {
        const real index = medium_of(edge->inner, w).index;
        p->specular_ior = pick(other, index, p->specular_ior);
        p->bending_ior = pick(other, index, p->bending_ior);
    }
    real around = R(1.0);
    if (any_lane(less(R(0.0), edge->around))) around = medium_of(edge->around, w).index;
    const mask clear = edge->glass & less(fabs(p->bending_ior - around), SAME_INDEX) & less_equal(R(1.0), p->transmission_weight) & ~spreads
                       & (less(R(0.0), p->transmission_depth) | less_equal(R(3.0), p->transmission_color.r + p->transmission_color.g + p->transmission_color.b))
                       & ~less(R(0.0), p->coat_weight + p->fuzz_weight + p->thin_film_weight + p->base_metalness + brightest(p->emission_color) * p->emission_luminance);
    edge->hidden |= clear;
    if (any_lane(less(R(0.0), edge->around))) {
        // Where the glass around is the denser one, the boundary is that of it, seen from its inside.
        const real share = R(1.0) / around, bends = p->bending_ior * share, mirrors = p->specular_ior * share;
        const mask thinner = less(bends, R(1.0));
        p->bending_ior = pick(thinner, R(1.0) / bends, bends);
        p->specular_ior = fmax(pick(thinner, R(1.0) / mirrors, mirrors), R(1.0));
        const mask glassy = thinner & less(R(0.0), p->transmission_weight);
        p->inside = pick(glassy, R(1.0) - p->inside, p->inside);
    }
    return weights;
}

// Whether a direction leads from an interaction to the outer side of its body.
INLINE mask leads_out(vec toward, vec normal, mask leaving) {
    const mask over = less(R(0.0), vec_dot(toward, normal));
    return (over & ~leaving) | (~over & leaving);
}

// Lets the glass on the outer side of a boundary absorb the light that was sampled there; of what is sought it is not known yet how far that is.
INLINE void awaited_absorbed(path_state *with, sought *seeks, border edge, real way, world w) {
    const mask through_glass = less(R(0.0), pick(edge.leaving, edge.around, with->medium));
    if (!any_lane(through_glass)) return;
    const color around = color_pick(edge.leaving, medium_of(edge.around, w).extinction, with->extinction);
    seeks->extinction = color_pick(through_glass, around, seeks->extinction);
    // Lights that throw no shadow have no way to go.
    with->awaited = color_pick(through_glass, absorbed(with->awaited, around, fmax(way, R(0.0))), with->awaited);
}

// Brings paths that are at a boundary over it if their direction leads there.
INLINE void path_crosses(path *so_far, path_state *with, const interaction *here, border edge, const pbr *p, mask sinks, color weights, real wave,
                         mask lands, world w) {
    const mask over = ~lands | less(R(0.0), vec_dot(so_far->direction, here->normal)), crosses = ~over;
    const mask stays_out = leads_out(so_far->direction, here->normal, edge.leaving);
    real body = edge.body;
    if (HAS(w, SUBSURFACE)) {
        // Colours stay together below a boundary.
        wave = pick(sinks, with->wave, wave);
        weights = color_pick(sinks, color_of(R(1.0), R(1.0), R(1.0)), weights);
        sinks = (sinks & ~edge.hidden) | (edge.hidden & ~less(R(0.0), p->transmission_weight));
        body += pick(sinks, SKIN, R(0.0));
    }
    so_far->through = color_pick(over, so_far->through, color_mul(so_far->through, weights));
    with->wave = pick(over, with->wave, wave);
    vec origin = here->seen;
    const mask of_set = of_the_set(here->object, w);
    const real lift = lift_of(here, w) * pick(over, R(1.0), R(-1.0));
    origin = vec_pick(of_set, origin, vec_along(here->point, lift, here->normal));
    so_far->origin = vec_pick(~lands | (stays_out & of_set), so_far->origin, origin);
    // Nobody samples light that reaches an interaction through its own body, or within the set.
    const mask within = is_set_body(pick(edge.leaving, edge.around, with->medium), w);
    with->density = pick(~lands | (stays_out & ~edge.hidden & ~within), with->density, R(-1.0));
    if (!any_lane(crosses)) return;
    if (HAS(w, SUBSURFACE)) {
        const mask to_skin = crosses & sinks & ~edge.leaving;
        bodies_leave(&edge.beyond, edge.body, to_skin);
        bodies_enter(&edge.beyond, body, to_skin);
    }
    path_state over_there = *with;
    bodies_keep(&over_there, edge.beyond);
    with->medium = pick(crosses, over_there.medium, with->medium);
    with->under = pick(crosses, over_there.under, with->under);
    const mask enters = crosses & ~edge.leaving & equal(with->medium, body);
    medium next = medium_of(with->medium, w), own = next;
    own.extinction = absorption_of(p->transmission_color, p->transmission_depth);
    medium_scatters(&own, p->transmission_scatter, p->transmission_depth, p->transmission_scatter_anisotropy);
    if (any_lane(sinks)) {
        own = medium_pick(sinks, medium_of_skin(p->subsurface_color, p->subsurface_radius, p->subsurface_radius_scale,
                                                p->subsurface_scatter_anisotropy), own);
    }
    media_found(with, medium_pick(enters, own, next), crosses);
}
