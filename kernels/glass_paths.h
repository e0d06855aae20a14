// Paths through glass: what they carry while they are inside the set, and how they get there.

// A place in the spectrum: the index of refraction there (`bend`, see `clfractal/renderers/glass.py`), and what it weighs.
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

// The material as a path meets it, from inside or not: for glass that spreads colours, at the path's wavelength, or at one that it
// takes if it is refracted now, `wave` in (0, 1), which then is the path's; the result is what it weighs then. The index by Cauchy's equation n = a + b / wavelength^2.
INLINE color glass_met(const carried *with, pbr *p, real *wave, __global const float *tables) {
    p->inside = with->inside;
    const color white = color_of(R(1.0), R(1.0), R(1.0));
    const mask spreads = less(R(0.0), p->transmission_weight * p->transmission_dispersion_scale);
    const mask fresh = spreads & less(with->wave, R(0.0));
    *wave = pick(fresh, *wave, with->wave);
    if (!any_lane(spreads)) return white;
    real bend;
    const color weights = spectrum_at(fmax(*wave, R(0.0)), &bend, tables + SPECTRUM);
    const real spread = p->transmission_dispersion_scale / p->transmission_dispersion_abbe_number;
    const real index = p->specular_ior + (p->specular_ior - R(1.0)) * spread * bend;
    p->bending_ior = pick(spreads, fmax(index, R(1.0)), p->specular_ior);
    // A path of all colours is reflected like their mean, so that those which are refracted are white together.
    p->specular_ior = pick(fresh, p->specular_ior, p->bending_ior);
    return color_pick(fresh, weights, white);
}

// Whether a direction leads from a spot into the open.
INLINE mask leads_out(vec toward, vec normal, real inside) {
    const mask over = less(R(0.0), vec_dot(toward, normal)), within = mask_of(inside);
    return (over & ~within) | (~over & within);
}

// What the medium takes away for each unit of the way, in natural logarithms.
INLINE color absorption_of(const pbr *p) {
    const real each = R(-1.0) / fmax(p->transmission_depth, R(1e-6));
    const mask deep = less(R(0.0), p->transmission_depth);
#define ABSORBED(c) pick(deep, each * log(fmax(p->transmission_color.c, R(1e-6))), R(0.0))
    return color_of(ABSORBED(r), ABSORBED(g), ABSORBED(b));
#undef ABSORBED
}

// Lets the medium absorb light on a way through it.
INLINE void path_absorbs(path *so_far, const carried *with, real way, world w) {
    const real far = pick(mask_of(with->inside), fmin(way, R(2.0) * (real)(w.settings->bounds_radius)), R(0.0));
    so_far->through.r *= exp(-far * with->absorption.r);
    so_far->through.g *= exp(-far * with->absorption.g);
    so_far->through.b *= exp(-far * with->absorption.b);
}

// After a direction was chosen: whether the path goes on inside, and what it carries there.
INLINE void path_crosses(path *so_far, carried *with, const spot *here, const pbr *p, color weights, real wave) {
    const mask over = less(R(0.0), vec_dot(so_far->direction, here->normal)), within = mask_of(with->inside);
    const mask stays_out = leads_out(so_far->direction, here->normal, with->inside);
    so_far->through = color_pick(over, so_far->through, color_mul(so_far->through, weights));
    with->wave = pick(over, with->wave, wave);
    with->absorption = color_pick(within, with->absorption, absorption_of(p));
    so_far->origin = vec_pick(stays_out, so_far->origin, here->seen);
    // Nobody asks for light that reaches a spot through the set.
    with->density = pick(stays_out, with->density, R(-1.0));
    with->inside = number_of(~stays_out);
}
