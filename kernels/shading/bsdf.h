// How a material scatters light, by OpenPBR 1.1's layers: fuzz over a coat over a base, which is a metal, or a dielectric's boundary
// over a diffuse body or glass. A layer takes what it reflects from those below it, so that all energy is kept. A diffuse body under its
// boundary gets 1 - albedo of the direction in which light comes and of the one in which it leaves, and is the same both ways. What is
// under a coat or fuzz may be a mirror, and gets 1 - albedo of the viewer's direction: paths begin at the eye. From inside glass nobody
// sees its coat and fuzz.
#include "elements/materials"

// A film on the base, as stages include it behind this: `elements/materials/costly`, or `plain_materials.h`. It puts it on a base that is
// ready but for its lobes' probabilities; it says with which probability a boundary is taken to reflect which reflects `share` without it,
// and what of the body's light comes through.
INLINE void film_begins(bsdf *b, const pbr *p, __global const float *tables);
INLINE real film_mirrored(const bsdf *b, real share);
INLINE color film_passed(const bsdf *b, color body);
// What it adds to the light of a facet `h` that mirrors `i` to the viewer, and takes from light from beyond. `toward`: the direction, of
// which `i` is what is not below the surface; `single`: what GGX reflects if facets reflect all, with the factor on highlights, `sharp`.
INLINE void film_adds(const bsdf *b, vec toward, vec i, vec h, real single, real sharp, __global const float *tables, color *over,
                      color *below);

INLINE vec bsdf_local(const bsdf *b, vec a) { return vec_of(vec_dot(a, b->side), vec_dot(a, b->up), vec_dot(a, b->normal)); }

// With which probability a facet of glass is taken to reflect.
INLINE real mirror_share(const bsdf *b, real cosine) { return film_mirrored(b, fresnel_across(cosine, b->clear.mirrors)); }

// With which probability each lobe is sampled: about by what it reflects.
INLINE void bsdf_choices(bsdf *b, __global const float *tables) {
    real of_gloss = R(0.0);
    if (any_of(b->dielectric * b->root)) of_gloss = specular_albedo(b, b->out, tables).of_direction;
    of_gloss = pick(b->emerges, R(0.0), film_mirrored(b, of_gloss));
    const real mirrored = b->metalness * fmax(luminance(b->metal), R(0.1)) + b->dielectric * of_gloss;
    real scattered = b->dielectric * (R(1.0) - of_gloss) * fmax(luminance(b->body), R(0.02)) + b->metalness * b->rough * R(0.3)
                           + luminance(b->fuzz);
    scattered += b->clear.weight * (R(1.0) - b->clear.crosses) * b->clear.lost;
    const real bent = b->clear.weight * (R(1.0) - b->clear.lost), lost = b->clear.weight * b->clear.crosses * b->clear.lost;
    const real sunk = below_sampled(b, of_gloss, &scattered);
    const real below = (R(1.0) - b->coat_albedo) * (mirrored + scattered + bent + lost), all = b->coat_albedo + below;
    b->by_below = (R(1.0) - b->coat_albedo) * sunk / all;
    b->below = color_scale(color_mul(b->below, b->coat_tint), (R(1.0) - b->fuzz_albedo) * all);
    b->by_glass = (R(1.0) - b->coat_albedo) * bent / all;
    b->by_beyond = (R(1.0) - b->coat_albedo) * lost / all;
    b->by_coat = b->coat_albedo / all;
    b->by_gloss = (R(1.0) - b->coat_albedo) * mirrored / all;
}

// `to_viewer` has length 1.
INLINE bsdf bsdf_at(const pbr *p, vec normal, vec to_viewer, __global const float *tables) {
    bsdf b;
    b.normal = b.surface = normal;
    specular_begins(&b, p, normal);
    b.relief = 0;
    b.leans = b.side;
    b.level = R(1.0);
    b.out = bsdf_local(&b, to_viewer);
    b.seen = less(R(0.0), b.out.z);
    b.out.z = fmax(b.out.z, R(1e-4));
    const mask inside = less(R(0.5), p->inside);
    base_begins(&b, p);
    coat_begins(&b, p, inside);
    fuzz_begins(&b, p, inside);
    transmission_begins(&b, p, tables);
    below_begins(&b, p, inside);
    coat_covers(&b, p, tables);
    fuzz_covers(&b, tables);
    film_begins(&b, p, tables);
    bsdf_choices(&b, tables);
    return b;
}

// What coat and fuzz leave of light that crosses the boundary.
#define THROUGH_LAYERS(b) color_scale((b)->coat_tint, (R(1.0) - (b)->coat_albedo) * (R(1.0) - (b)->fuzz_albedo))

// f * cosine, with factors on what is diffuse and on highlights; 0 for directions below the surface, unless it is glass.
INLINE color bsdf_parts(const bsdf *b, vec toward, real broad, real sharp, __global const float *tables) {
    vec i = bsdf_local(b, toward);
    const mask over = b->seen & less(R(0.0), i.z);
    const color none = color_of(R(0.0), R(0.0), R(0.0));
    color below = none;
    const mask under = b->seen & less(i.z, R(0.0));
    if (any_lane(under & less(R(0.0), b->clear.weight))) {
        const color passes = color_scale(glass_passes(&b->clear, b->out, i, tables), b->clear.weight);
        below = color_pick(under, color_scale(color_mul(passes, THROUGH_LAYERS(b)), sharp), below);
    }
    const vec from = i;
    i.z = fmax(i.z, R(1e-6));
    const vec h = middle_way(b->out, i);
    const real single = ggx_value(b->out, i, h, b->facets) * lobe_share(broad, sharp, b->facets.alpha);
    color sum = none;
    if (any_of(b->dielectric)) {
        color body = eon_value(b->body, b->out, i, b->rough_body);
        albedo o = {R(0.0), R(0.0)}, other = o;
        real gloss = R(0.0);
        if (any_of(b->root)) {
            o = specular_albedo(b, b->out, tables);
            other = specular_albedo(b, i, tables);
            gloss = single * fresnel_dielectric(vec_dot(b->out, h), b->ior);
        }
        o.of_direction = pick(b->emerges, R(0.0), o.of_direction);
        body = film_passed(b, color_scale(body, b->bare));
        sum = color_scale(color_add(color_scale(b->gloss, gloss), color_scale(body, i.z * through_boundary(o, other) * broad)),
                          b->dielectric);
    }
    if (any_of(b->clear.weight)) {
        // The tint of the boundary is that of its outer side.
        const color tint = color_pick(b->clear.inside, color_of(R(1.0), R(1.0), R(1.0)), b->gloss);
        const real facets = ggx_value(b->out, i, h, b->facets);
        const real reflects = b->clear.weight * glass_reflects(&b->clear, b->out, i, h, facets, tables) * sharp;
        sum = color_add(sum, color_scale(tint, reflects));
    }
    if (any_of(b->metalness)) sum = color_add(sum, color_scale(metal_value(b, i, h, single, broad, tables), b->metalness));
    film_adds(b, from, i, h, single, sharp, tables, &sum, &below);
    if (any_of(b->coat)) sum = coat_over(b, sum, i, h, broad, sharp);
    if (any_of(brightest(b->fuzz))) sum = fuzz_over(b, sum, i, broad);
    return color_pick(over, sum, below);
}

// Probability per steradian with which bsdf_sample chooses a direction, with the same factors.
INLINE real bsdf_densities(const bsdf *b, vec toward, real broad, real sharp) {
    const vec i = bsdf_local(b, toward), h = middle_way(b->out, i);
    const real of_coat = b->by_coat * lobe_share(broad, sharp, b->coat_facets.alpha);
    const real of_gloss = b->by_gloss * lobe_share(broad, sharp, b->facets.alpha);
    real around = R(1.0) - b->by_coat - b->by_gloss - b->by_glass - b->by_beyond;
    around = pick(less(R(0.0), b->by_below), fmax(around - b->by_below, R(0.0)), around);
    const real hemisphere = broad * around * fmax(i.z, R(0.0)) / BSDF_PI;
    real facets = of_gloss, beyond = R(0.0);
    if (any_of(b->clear.weight)) {
        const glass *g = &b->clear;
        facets += b->by_glass * sharp * mirror_share(b, vec_dot(b->out, h));
        const vec bends = bending_facet(b->out, i, g->across);
        const real bent = b->by_glass * (R(1.0) - mirror_share(b, vec_dot(b->out, bends))) * bending_density(g, b->out, i, bends);
        beyond = sharp * (bent + b->by_beyond * fmax(-i.z, R(0.0)) / BSDF_PI);
    }
    const real sum = hemisphere + facets * ggx_density(b->out, h, b->facets) + of_coat * ggx_density(b->out, h, b->coat_facets);
    return pick(b->seen, pick(less(R(0.0), i.z), sum, pick(less(i.z, R(0.0)), beyond, R(0.0))), R(0.0));
}

// A direction chosen by three numbers in (0, 1), and whether light is scattered there.
INLINE vec bsdf_sample(const bsdf *b, real choice, real u, real v, mask *usable) {
    const mask coat = less(choice, b->by_coat), gloss = ~coat & less(choice, b->by_coat + b->by_gloss);
    const vec h = ggx_facet(b->out, slopes_pick(coat, b->coat_facets, b->facets), u, v), mirrored = mirrored_by(b->out, h);
    const vec around = hemisphere_direction(vec_of(R(0.0), R(0.0), R(1.0)), u, v);
    vec i = vec_pick(coat | gloss, mirrored, around);
    mask below = coat & ~coat;
    if (any_of(b->clear.weight)) {
        const real before = b->by_coat + b->by_gloss, after = before + b->by_glass;
        const mask facet = ~coat & ~gloss & less(choice, after), beyond = ~coat & ~gloss & ~facet & less(choice, after + b->by_beyond);
        const mask bends = facet & less(mirror_share(b, vec_dot(b->out, h)), (choice - before) / b->by_glass);
        i = vec_pick(bends, refracted_at(b->out, h, b->clear.across), vec_pick(facet, mirrored, i));
        i.z = pick(beyond, -i.z, i.z);
        below = bends | beyond;
    }
    // A facet that mirrors below the surface, or refracts above it, is hidden by others.
    *usable = b->seen & less(R(0.0), pick(below, -i.z, i.z));
    return vec_along(vec_along(vec_scale(b->normal, i.z), i.x, b->side), i.y, b->up);
}
