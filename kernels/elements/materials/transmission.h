// Rough glass: a dielectric's boundary that reflects and refracts (Walter and others 2007, Microfacet Models for Refraction through
// Rough Surfaces). The viewer may be on either side of it.
//
// Light is told as radiance over the square of the index of refraction where it is, which refraction does not change: inside a white
// furnace all is white, too. So f / index^2 of the light's side is the same both ways. What light between facets loses is given back
// by lobes that know no direction (after Kulla and Conty 2017): of the light that is lost the part `crosses` comes out on the other
// side, which each side has by how much it loses, times the square of its index.
#include "specular.h"

#define GLASS_LEAST R(1.005)   // the index of glass: below it float32 cannot tell where light is bent to

INLINE albedo glass_albedo(__global const float *tables, vec from, const glass *g, int beyond) {
    const mask inside = beyond ? ~g->inside : g->inside;
    albedo a = {R(1.0), R(1.0)};
    for (int side = 0; side < 2; ++side) {
        const mask here = side ? inside : ~inside;
        if (!any_lane(here)) continue;
        const albedo found = specular_passed(g->facets, g->rough, g->root, from, side, tables);
        a.of_direction = pick(here, found.of_direction, a.of_direction);
        a.mean = pick(here, found.mean, a.mean);
    }
    return a;
}

// `out`: the viewer's direction.
INLINE glass glass_at(real weight, vec out, real inside, real ior, real bending, real rough, slopes facets, real root, color tint,
                      __global const float *tables) {
    const real index = fmax(bending, GLASS_LEAST), mean = fmax(ior, GLASS_LEAST);
    const mask within = less(R(0.5), inside);
    glass g = {.weight = weight, .across = pick(within, R(1.0) / index, index), .mirrors = pick(within, R(1.0) / mean, mean),
               .facets = facets, .rough = rough, .root = root, .inside = within, .tint = tint,
               .mean_lost = R(1.0), .mean_beyond = R(1.0)};
    if (!any_lane(less(R(0.0), weight))) return g;
    const albedo here = glass_albedo(tables, out, &g, 0), beyond = glass_albedo(tables, out, &g, 1);
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
    const real density = R(4.0) * before * ggx_density(o, h, g->facets) * turning;
    return pick(less(R(0.0), before) & less(beyond, R(0.0)), density, R(0.0));
}

// f * cosine of light from the viewer's side, but for the tint; `single` is GGX's with a reflectance of 1.
INLINE real glass_reflects(const glass *g, vec o, vec i, vec h, real single, __global const float *tables) {
    const real other = R(1.0) - glass_albedo(tables, i, g, 0).of_direction;
    return single * fresnel_across(vec_dot(o, h), g->mirrors)
           + (R(1.0) - g->crosses) * g->lost * other / (BSDF_PI * g->mean_lost) * i.z;
}

// f * cosine of light from beyond.
INLINE color glass_passes(const glass *g, vec o, vec i, __global const float *tables) {
    const vec h = bending_facet(o, i, g->across);
    const vec up = vec_of(i.x, i.y, fmax(-i.z, R(1e-6)));
    const real other = R(1.0) - glass_albedo(tables, up, g, 1).of_direction;
    const real once = bending_density(g, o, i, h) * (R(1.0) - fresnel_across(vec_dot(o, h), g->mirrors))
                      / (R(1.0) + ggx_lambda(up, g->facets));
    return color_scale(g->tint, once + g->crosses * g->lost * other / (BSDF_PI * g->mean_beyond) * up.z);
}

INLINE void transmission_begins(bsdf *b, const pbr *p, __global const float *tables) {
    const color tint = color_pick(less(R(0.0), p->transmission_depth), color_of(R(1.0), R(1.0), R(1.0)), p->transmission_color);
    const real bent_root = fmin((p->bending_ior - R(1.0)) / (p->bending_ior + R(1.0)) * sqrt(p->specular_weight), R(0.98));
    const real bending = (R(1.0) + bent_root) / (R(1.0) - bent_root);
    b->clear = glass_at(b->dielectric * p->transmission_weight, b->out, p->inside, b->ior, bending, b->rough, b->facets, b->root, tint, tables);
    b->dielectric *= R(1.0) - p->transmission_weight;
}
