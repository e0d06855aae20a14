// Rough glass: a dielectric's boundary that reflects and refracts (Walter and others 2007, Microfacet Models for Refraction through
// Rough Surfaces). The viewer may be on either side of it.
//
// Light is told as radiance over the square of the index of refraction where it is, which refraction does not change: inside a white
// furnace all is white, too. So f / index^2 of the light's side is the same both ways. What light between facets loses is given back
// by lobes that know no direction (after Kulla and Conty 2017): of the light that is lost the part `crosses` comes out on the other
// side, which each side has by how much it loses, times the square of its index.
#define GLASS_LEAST R(1.005)   // the index of glass: below it float32 cannot tell where light is bent to

typedef struct {
    real weight;             // part of the surface that is glass
    real across;             // index of the side beyond over the viewer's ...
    real mirrors;            // ... and as reflectances have it: the mean of all colours, where they part only now
    real alpha, rough, root;
    mask inside;             // whether the viewer is
    color tint;              // of what crosses the boundary
    real lost, mean_lost;    // between facets: of the viewer's direction; of all on this side
    real mean_beyond;        // the same on the other side
    real crosses;
} glass;

INLINE albedo glass_albedo(__global const float *tables, real cosine, const glass *g, int beyond) {
    const mask inside = beyond ? ~g->inside : g->inside;
    albedo a = {R(1.0), R(1.0)};
    for (int side = 0; side < 2; ++side) {
        const mask here = side ? inside : ~inside;
        if (!any_lane(here)) continue;
        const albedo found = albedo_of_root(tables + (side ? ALBEDO_GLASS_INSIDE : ALBEDO_GLASS), cosine, g->rough, sqrt(g->root));
        a.of_direction = pick(here, found.of_direction, a.of_direction);
        a.mean = pick(here, found.mean, a.mean);
    }
    return a;
}

// `cosine`: of the viewer's direction with the normal on its side.
INLINE glass glass_at(real weight, real cosine, real inside, real ior, real bending, real rough, real alpha, real root, color tint,
                      __global const float *tables) {
    const real index = fmax(bending, GLASS_LEAST), mean = fmax(ior, GLASS_LEAST);
    const mask within = less(R(0.5), inside);
    glass g = {.weight = weight, .across = pick(within, R(1.0) / index, index), .mirrors = pick(within, R(1.0) / mean, mean),
               .alpha = alpha, .rough = rough, .root = root, .inside = within, .tint = tint,
               .mean_lost = R(1.0), .mean_beyond = R(1.0)};
    if (!any_lane(less(R(0.0), weight))) return g;
    const albedo here = glass_albedo(tables, cosine, &g, 0), beyond = glass_albedo(tables, cosine, &g, 1);
    g.lost = R(1.0) - here.of_direction;
    g.mean_lost = fmax(R(1.0) - here.mean, R(1e-6));
    g.mean_beyond = fmax(R(1.0) - beyond.mean, R(1e-6));
    const real other = g.across * g.across * g.mean_beyond;
    g.crosses = other / (g.mean_lost + other);
    return g;
}

// The reflectance of the boundary where `across` is the index beyond it over that before it; 1 for total reflection.
INLINE real fresnel_across(real cosine, real across) {
    const real square = across * across - R(1.0) + cosine * cosine, g = sqrt(fmax(square, R(0.0)));
    const real a = (g - cosine) / fmax(g + cosine, R(1e-12));
    const real b = (cosine * (g + cosine) - R(1.0)) / (cosine * (g - cosine) + R(1.0));
    return pick(less(R(0.0), square), fmin(R(0.5) * a * a * (R(1.0) + b * b), R(1.0)), R(1.0));
}

// What lies beyond the boundary at a facet `h` over it.
INLINE vec refracted_at(vec o, vec h, real across) {
    const real cosine = vec_dot(o, h), ratio = R(1.0) / across;
    const real other = sqrt(fmax(R(1.0) - ratio * ratio * (R(1.0) - cosine * cosine), R(0.0)));
    return vec_sub(vec_scale(h, ratio * cosine - other), vec_scale(o, ratio));
}

// The facet that refracts between two directions on different sides.
INLINE vec bending_facet(vec o, vec i, real across) {
    const vec h = vec_normalize(vec_along(o, across, i));
    return vec_scale(h, pick(less(h.z, R(0.0)), R(-1.0), R(1.0)));
}

// Density per steradian with which visible normals refract to a direction beyond the boundary, and none is reflected.
INLINE real bending_density(const glass *g, vec o, vec i, vec h) {
    const real before = vec_dot(o, h), beyond = vec_dot(i, h), both = before + g->across * beyond;
    const real turning = g->across * g->across * fabs(beyond) / fmax(both * both, (real)(REAL_SMALLEST));
    const real density = R(4.0) * before * ggx_density(o, h, g->alpha) * turning;
    return pick(less(R(0.0), before) & less(beyond, R(0.0)), density, R(0.0));
}

// f * cosine of light from the viewer's side, but for the tint; `single` is GGX's with a reflectance of 1.
INLINE real glass_reflects(const glass *g, vec o, vec i, vec h, real single, __global const float *tables) {
    const real other = R(1.0) - glass_albedo(tables, i.z, g, 0).of_direction;
    return single * fresnel_across(vec_dot(o, h), g->mirrors)
           + (R(1.0) - g->crosses) * g->lost * other / (BSDF_PI * g->mean_lost) * i.z;
}

// f * cosine of light from beyond.
INLINE color glass_passes(const glass *g, vec o, vec i, __global const float *tables) {
    const vec h = bending_facet(o, i, g->across);
    const vec up = vec_of(i.x, i.y, fmax(-i.z, R(1e-6)));
    const real other = R(1.0) - glass_albedo(tables, up.z, g, 1).of_direction;
    const real once = bending_density(g, o, i, h) * (R(1.0) - fresnel_across(vec_dot(o, h), g->mirrors))
                      / (R(1.0) + ggx_lambda(up, g->alpha));
    return color_scale(g->tint, once + g->crosses * g->lost * other / (BSDF_PI * g->mean_beyond) * up.z);
}
