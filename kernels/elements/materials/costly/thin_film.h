// Interference in a thin film on a base: what its two boundaries reflect adds up by its phase (Airy's sum, for both polarisations), at
// even steps of the wavenumber, which are weighed by the colours that they have. The base is a dielectric, or a metal, whose index is the
// complex one with its reflectance straight on and at 82 degrees. What is added to the light of a bare base is that with the film less
// that without it, so that a film of no thickness changes nothing.
#include "shading/bsdf.h"

#define FILM_FADES R(8.0)   // micrometres: films with twice this optical path have no colour left, those below all

// An amplitude or a complex index.
typedef struct {
    real re, im;
} wave;

INLINE real wave_square(wave a) { return a.re * a.re + a.im * a.im; }

// (a - b) / (a + b): what a boundary reflects by Fresnel.
INLINE wave wave_reflected(wave a, wave b) {
    const real across = a.re + b.re, along = a.im + b.im, square = fmax(across * across + along * along, R(1e-20));
    return (wave){(wave_square(a) - wave_square(b)) / square, R(2.0) * (a.im * b.re - a.re * b.im) / square};
}

// Of one polarisation: where the phase is p, 1 - passes / (sum + even cos p + odd sin p) is reflected.
typedef struct {
    real passes, sum, even, odd;
} echo;

// From the amplitudes at the outer boundary, a real one, and at the inner one.
INLINE echo echo_of(real outer, wave inner) {
    const real a = outer * outer, b = wave_square(inner);
    return (echo){(R(1.0) - a) * (R(1.0) - b), R(1.0) + a * b, R(2.0) * outer * inner.re, R(-2.0) * outer * inner.im};
}

// What both polarisations let pass, where the phase has this cosine and sine; and the mean over all phases.
INLINE real echoes_pass(const echo *e, real cosine, real sine) {
    const real one = fmax(e[0].sum + e[0].even * cosine + e[0].odd * sine, R(1e-9));
    const real two = fmax(e[1].sum + e[1].even * cosine + e[1].odd * sine, R(1e-9));
    return R(0.5) * (e[0].passes * two + e[1].passes * one) / (one * two);
}
INLINE real echoes_mean(const echo *e) {
    const real one = fmax(R(2.0) - e[0].sum, R(1e-9)), two = fmax(R(2.0) - e[1].sum, R(1e-9));
    return R(0.5) * (e[0].passes / one + e[1].passes / two);
}

// The colour that is reflected with an optical path of `path` micrometres: of one pair of echoes, or of one for each colour.
INLINE color film_color(const echo *echoes, int pairs, real path, __global const float *tables) {
    __global const float *weights = tables + WAVE_COLORS;
    const real longest = R(1000.0) / (real)((scalar)WAVE_LONGEST_NM), shortest = R(1000.0) / (real)((scalar)WAVE_SHORTEST_NM);
    const real first = path * longest, each = path * (shortest - longest) / (real)((scalar)(WAVE_COUNT - 1));
    const real begins = R(2.0) * BSDF_PI * (first - floor(first)), turns = R(2.0) * BSDF_PI * (each - floor(each));
    const real onward = cos(turns), aside = sin(turns);
    real cosine = cos(begins), sine = sin(begins);
    color passes = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < WAVE_COUNT; ++i) {
        const real red = echoes_pass(echoes, cosine, sine);
        const real green = pairs == 1 ? red : echoes_pass(echoes + 2, cosine, sine);
        const real blue = pairs == 1 ? red : echoes_pass(echoes + 4, cosine, sine);
        passes.r += red * (real)((scalar)weights[3 * i]);
        passes.g += green * (real)((scalar)weights[3 * i + 1]);
        passes.b += blue * (real)((scalar)weights[3 * i + 2]);
        const real next = cosine * onward - sine * aside;
        sine = sine * onward + cosine * aside;
        cosine = next;
    }
    const color mean = color_of(echoes_mean(echoes), echoes_mean(echoes + 2 * (pairs / 2)), echoes_mean(echoes + 4 * (pairs / 2)));
    passes = color_mix(mean, passes, clamp(R(2.0) - path / FILM_FADES, R(0.0), R(1.0)));
    return color_of(clamp(R(1.0) - passes.r, R(0.0), R(1.0)), clamp(R(1.0) - passes.g, R(0.0), R(1.0)),
                    clamp(R(1.0) - passes.b, R(0.0), R(1.0)));
}

// The root of index^2 - sine^2, which is the index times the cosine within.
INLINE real index_along(real index, real cosine) { return sqrt(fmax(index * index - R(1.0) + cosine * cosine, R(1e-12))); }

// What a film adds to the light that a dielectric reflects, seen from outside.
CALLED void film_on_dielectric(real film_ior, real thickness, real cosine, real ior, __global const float *tables, color *adds) {
    const real c = fmax(cosine, R(1e-4)), within = index_along(film_ior, c), below = index_along(ior, c);
    const wave air = {c, R(0.0)}, level = {within, R(0.0)}, base = {below, R(0.0)};
    const wave level_p = {within / (film_ior * film_ior), R(0.0)}, base_p = {below / (ior * ior), R(0.0)};
    const echo echoes[2] = {echo_of(wave_reflected(air, level).re, wave_reflected(level, base)),
                            echo_of(wave_reflected(air, level_p).re, wave_reflected(level_p, base_p))};
    const real bare = fresnel_dielectric(c, ior);
    const color all = film_color(echoes, 1, R(2.0) * within * thickness, tables);
    *adds = color_of(all.r - bare, all.g - bare, all.b - bare);
}

// The complex index of a metal that reflects `straight` at normal incidence and about `edge` where the cosine is 1/7. With the index's
// squared absolute value m, (1 - s) / (1 + s) = 2 n / (m + 1) for the reflectance s straight on, and at the edge, where m is large,
// 2 n c / m and 2 n c / (m c^2 + 1) likewise for the two polarisations.
INLINE wave metal_index(real straight, real edge) {
    const real s = clamp(straight, R(0.0), R(0.999)), u = (R(1.0) - s) / (R(1.0) + s), c = R(1.0) / R(7.0);
    const real along = R(2.0) * edge - (R(1.0) - c * u) / (R(1.0) + c * u), y = fmax((R(1.0) - along) / (R(1.0) + along), R(0.0));
    const real root = sqrt(s), largest = (R(1.0) + root) / (R(1.0) - root);
    const real m = clamp((y - c * u) / fmax(c * u - c * c * y, R(1e-6)), R(1.0), largest * largest), n = R(0.5) * u * (m + R(1.0));
    return (wave){n, sqrt(fmax(m - n * n, R(0.0)))};
}

// The root of n^2 - sine^2 over 1, and over n^2 (for light polarised across).
INLINE void index_within(wave n, real cosine, wave *s, wave *p) {
    const real re = n.re * n.re - n.im * n.im, im = R(2.0) * n.re * n.im, x = re - R(1.0) + cosine * cosine;
    const real large = sqrt(fmax(R(0.5) * (sqrt(x * x + im * im) + fabs(x)), R(1e-12))), small = R(0.5) * im / large;
    const mask below = less(x, R(0.0));
    *s = (wave){pick(below, small, large), pick(below, large, small)};
    const real square = fmax(re * re + im * im, R(1e-12));
    *p = (wave){(s->re * re + s->im * im) / square, (s->im * re - s->re * im) / square};
}

// What a film adds to the light that a metal with these reflectances straight on and these tints at its edges reflects.
CALLED void film_on_metal(real film_ior, real thickness, real cosine, const color *straight, const color *edge,
                          __global const float *tables, color *adds) {
    const real c = fmax(cosine, R(1e-4)), within = index_along(film_ior, c);
    const wave air = {c, R(0.0)}, level = {within, R(0.0)}, level_p = {within / (film_ior * film_ior), R(0.0)};
    const real outer = wave_reflected(air, level).re, outer_p = wave_reflected(air, level_p).re;
    echo echoes[6];
    color bare, share, physical;
#define FILM_METAL(k, i)                                                                                                     \
    {                                                                                                                        \
        wave s, p;                                                                                                           \
        index_within(metal_index(straight->k, fresnel_metal(R(1.0) / R(7.0), straight->k, edge->k)), c, &s, &p);             \
        echoes[i] = echo_of(outer, wave_reflected(level, s));                                                                \
        echoes[i + 1] = echo_of(outer_p, wave_reflected(level_p, p));                                                        \
        physical.k = R(0.5) * (wave_square(wave_reflected(air, s)) + wave_square(wave_reflected(air, p)));                   \
        bare.k = fresnel_metal(c, straight->k, edge->k);                                                                     \
        share.k = fmin(bare.k / fmax(physical.k, R(1e-6)), R(1.0));                                                          \
    }
    FILM_METAL(r, 0) FILM_METAL(g, 2) FILM_METAL(b, 4)
#undef FILM_METAL
    const color all = film_color(echoes, 3, R(2.0) * within * thickness, tables);
#define FILM_ADDED(k) (clamp(bare.k + share.k * (all.k - physical.k), R(0.0), R(1.0)) - bare.k)
    *adds = color_of(FILM_ADDED(r), FILM_ADDED(g), FILM_ADDED(b));
#undef FILM_ADDED
}

// What it adds at a facet of a metal.
INLINE color film_at_metal(const bsdf *b, real cosine, __global const float *tables) {
    const color straight = b->metal, edge = b->edge;
    color adds;
    film_on_metal(b->film.ior, b->film.thickness, cosine, &straight, &edge, tables, &adds);
    return color_scale(adds, b->film.weight);
}

// What it adds at a facet of a dielectric or of glass, from either side: that of glass which reflects all does so with it, too.
INLINE color film_at_facet(const bsdf *b, real cosine, __global const float *tables) {
    const real ior = pick(less(R(0.0), b->clear.weight), fmax(b->ior, GLASS_LEAST), b->ior);
    const real outside = R(1.0) - ior * ior * (R(1.0) - cosine * cosine);
    const real seen = pick(b->clear.inside, sqrt(fmax(outside, R(0.0))), cosine);
    color adds;
    film_on_dielectric(b->film.ior, b->film.thickness, seen, ior, tables, &adds);
    const mask whole = b->clear.inside & less_equal(outside, R(0.0));
    return color_scale(color_pick(whole, color_of(R(0.0), R(0.0), R(0.0)), adds), b->film.weight);
}

CALLED void film_put_on(bsdf *b, const pbr *p, __global const float *tables) {
    const mask none = b->emerges | less_equal(p->thin_film_thickness, R(0.0));
    b->film.weight = pick(none, R(0.0), p->thin_film_weight);
    b->film.thickness = p->thin_film_thickness;
    b->film.ior = p->thin_film_ior;
    __global const float *facets = tables + FACETS_MET;
    const real met = albedo_at(facets, b->out.z, b->rough).of_direction;
    const real mean = albedo_at(facets + ALBEDO_TABLE, b->out.z, b->rough).of_direction;
    const real spread = albedo_at(facets + 2 * ALBEDO_TABLE, b->out.z, b->rough).of_direction;
    color metal = color_of(R(0.0), R(0.0), R(0.0)), adds = metal;
    for (int i = -1; i <= 1; ++i) {
        const real cosine = clamp(mean + (real)((scalar)i) * R(1.7320508) * spread, R(1e-4), R(1.0));
        const real part = i == 0 ? R(0.6666666666666667) : R(0.1666666666666667);
        if (any_of(b->metalness)) {
            metal = color_add(metal, color_scale(film_at_metal(b, cosine, tables), part));
        }
        if (any_of(b->dielectric + b->clear.weight)) adds = color_add(adds, color_scale(film_at_facet(b, cosine, tables), part * met));
    }
    b->film.again = color_add(b->metal, metal);
    const real passes = fmax(R(1.0) - specular_albedo(b, b->out, tables).of_direction, R(1e-3));
#define FILM_LEAVES(k) clamp(R(1.0) - adds.k / passes, R(0.0), R(1.0) / passes)
    b->film.through = color_of(FILM_LEAVES(r), FILM_LEAVES(g), FILM_LEAVES(b));
#undef FILM_LEAVES
    b->below = color_mul(b->below, b->film.through);
    b->more = clamp(luminance(adds) / passes, R(0.0), R(0.95));
}

INLINE void film_begins(bsdf *b, const pbr *p, __global const float *tables) {
    b->film.weight = b->more = R(0.0);
    if (any_of(p->thin_film_weight)) film_put_on(b, p, tables);
}

INLINE color film_again(const bsdf *b) { return any_of(b->film.weight) ? b->film.again : b->metal; }
INLINE real film_mirrored(const bsdf *b, real share) { return share + (R(1.0) - share) * b->more; }
INLINE color film_passed(const bsdf *b, color body) { return any_of(b->film.weight) ? color_mul(body, b->film.through) : body; }

// What it adds at a facet, and takes from that which bends light from beyond; `clear`: what facets of glass reflect if they reflect all.
CALLED void film_at(const bsdf *b, const vec *toward, const vec *h, real single, real clear, __global const float *tables, color *over,
                    color *beyond) {
    const real met = vec_dot(b->out, *h);
    if (any_of(b->metalness)) {
        *over = color_add(*over, color_scale(film_at_metal(b, met, tables), b->metalness * single));
    }
    if (!any_of(b->dielectric + b->clear.weight)) return;
    const glass *g = &b->clear;
    const mask under = less(toward->z, R(0.0));
    const vec bends = bending_facet(b->out, *toward, g->across);
    const color adds = film_at_facet(b, clamp(pick(under, vec_dot(b->out, bends), met), R(0.0), R(1.0)), tables);
    const color tint = color_pick(g->inside, color_of(R(1.0), R(1.0), R(1.0)), b->gloss);
    const color mirrored = color_add(color_scale(b->gloss, b->dielectric * single), color_scale(tint, g->weight * clear));
    *over = color_add(*over, color_mul(mirrored, adds));
    if (!any_lane(under)) return;
    const vec up = vec_of(toward->x, toward->y, fmax(-toward->z, R(1e-6)));
    const real bent = bending_density(g, b->out, *toward, bends) / (R(1.0) + ggx_lambda(up, g->facets));
    *beyond = color_scale(color_mul(g->tint, adds), g->weight * bent);
}

INLINE void film_adds(const bsdf *b, vec toward, vec i, vec h, real single, real sharp, __global const float *tables, color *over,
                      color *below) {
    if (!any_of(b->film.weight)) return;
    color beyond = color_of(R(0.0), R(0.0), R(0.0));
    film_at(b, &toward, &h, single, ggx_value(b->out, i, h, b->facets) * sharp, tables, over, &beyond);
    const color taken = color_scale(color_mul(beyond, THROUGH_LAYERS(b)), -sharp);
    *below = color_add(*below, color_pick(b->seen & less(toward.z, R(0.0)), taken, color_of(R(0.0), R(0.0), R(0.0))));
}
