// How a material scatters light, by OpenPBR 1.1's layers: fuzz over a coat over a base, which is a metal, or a dielectric's boundary
// over a diffuse body or glass. A layer takes what it reflects from those below it, so that all energy is kept. A diffuse body under its
// boundary gets 1 - albedo of the direction in which light comes and of the one in which it leaves, and is the same both ways. What is
// under a coat or fuzz may be a mirror, and gets 1 - albedo of the viewer's direction: paths begin at the eye. From inside glass nobody
// sees its coat and fuzz.
#include "shading/albedos.h"
#include "shading/microfacets.h"
#include "shading/bsdf_below.h"

// What a body's boundary lets in and out.
INLINE real through_boundary(albedo o, albedo i) {
    return (R(1.0) - o.of_direction) * (R(1.0) - i.of_direction) / fmax(R(1.0) - o.mean, R(1e-6));
}

INLINE vec bsdf_local(const bsdf *b, vec a) { return vec_of(vec_dot(a, b->side), vec_dot(a, b->up), vec_dot(a, b->normal)); }

// With which probability each lobe is sampled: about by what it reflects.
INLINE void bsdf_choices(bsdf *b, __global const float *tables) {
    real of_gloss = R(0.0);
    if (any_of(b->dielectric * b->root)) of_gloss = albedo_of_dielectric(tables, b->out.z, b->rough, b->root).of_direction;
    of_gloss = pick(b->emerges, R(0.0), of_gloss);
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
    make_frame(normal, &b.side, &b.up);
    b.relief = 0;
    b.leans = b.side;
    b.level = R(1.0);
    b.out = bsdf_local(&b, to_viewer);
    b.seen = less(R(0.0), b.out.z);
    b.out.z = fmax(b.out.z, R(1e-4));
    b.metal = b.body = color_scale(p->base_color, p->base_weight);
    b.metalness = p->base_metalness;
    b.rough_body = p->base_diffuse_roughness;
    b.rough = p->specular_roughness;
    b.alpha = alpha_of(b.rough);
    b.gloss = b.edge = p->specular_color;
    b.root = fmin((p->specular_ior - R(1.0)) / (p->specular_ior + R(1.0)) * sqrt(p->specular_weight), R(0.98));
    b.ior = (R(1.0) + b.root) / (R(1.0) - b.root);
    b.coat = p->coat_weight;
    b.coat_tint = color_mix(color_of(R(1.0), R(1.0), R(1.0)), p->coat_color, b.coat);
    b.coat_rough = p->coat_roughness;
    b.coat_alpha = alpha_of(b.coat_rough);
    b.coat_ior = p->coat_ior;
    b.coat_root = (b.coat_ior - R(1.0)) / (b.coat_ior + R(1.0));
    b.fuzz = color_scale(p->fuzz_color, p->fuzz_weight);
    b.fuzz_rough = fmax(p->fuzz_roughness, SMOOTHEST_FUZZ);
    b.coat_albedo = b.fuzz_albedo = R(0.0);
    b.dielectric = R(1.0) - b.metalness;
    const mask inside = less(R(0.5), p->inside);
    b.coat = pick(inside, R(0.0), b.coat);
    b.coat_tint = color_pick(inside, color_of(R(1.0), R(1.0), R(1.0)), b.coat_tint);
    b.fuzz = color_pick(inside, color_of(R(0.0), R(0.0), R(0.0)), b.fuzz);
    const color tint = color_pick(less(R(0.0), p->transmission_depth), color_of(R(1.0), R(1.0), R(1.0)), p->transmission_color);
    const real bent_root = fmin((p->bending_ior - R(1.0)) / (p->bending_ior + R(1.0)) * sqrt(p->specular_weight), R(0.98));
    const real bending = (R(1.0) + bent_root) / (R(1.0) - bent_root);
    b.clear = glass_at(b.dielectric * p->transmission_weight, b.out.z, p->inside, b.ior, bending, b.rough, b.alpha, b.root, tint, tables);
    b.dielectric *= R(1.0) - p->transmission_weight;
    below_begins(&b, p, inside);
    if (any_of(b.coat)) {
        // Light that the coat's inner side reflects meets the body again (OpenPBR 1.1, Coat darkening).
        const real inner = R(1.0) - (R(1.0) - albedo_of_dielectric(tables, R(1.0), b.coat_rough, b.coat_root).mean) / (b.coat_ior * b.coat_ior);
        const real most = b.coat * p->coat_darkening;
#define DARKENING(c) (R(1.0) - most + most * (R(1.0) - inner) / (R(1.0) - inner * (c)))
        b.body = color_of(b.body.r * DARKENING(b.body.r), b.body.g * DARKENING(b.body.g), b.body.b * DARKENING(b.body.b));
        b.below = color_of(DARKENING(p->subsurface_color.r), DARKENING(p->subsurface_color.g), DARKENING(p->subsurface_color.b));
        b.metal = b.body;
        b.coat_albedo = b.coat * albedo_of_dielectric(tables, b.out.z, b.coat_rough, b.coat_root).of_direction;
    }
    if (any_of(brightest(b.fuzz))) {
        b.fuzz_albedo = brightest(b.fuzz) * albedo_at(tables + ALBEDO_FUZZ, b.out.z, b.fuzz_rough).of_direction;
    }
    bsdf_choices(&b, tables);
    return b;
}

// f * cosine of a metal. Of light that is reflected more than once between its facets, `several`, the lobes have a direction: that of wider
// facets. Their colour is what the first, the last and those between reflect; see `clfractal/shading/facets.py`.
INLINE color metal_value(const bsdf *b, vec i, vec h, real single, real several, __global const float *tables) {
    const real meeting = vec_dot(b->out, h), wide = fmax(b->rough, (real)((scalar)REPEATED_NARROWEST_TENTHS * S(0.1)));
    const repeated o = repeated_at(tables, b->out.z, b->rough), other = repeated_at(tables, i.z, b->rough);
    const real lobe = several * (ggx_value(b->out, i, h, wide) + (real)((scalar)REPEATED_EVEN_HUNDREDTHS * S(0.01)) * i.z);
    const real twice = lobe * o.twice * other.twice, more = lobe * o.more * other.more;
    // After more than two facets each time about as much goes on to the next one.
    const real onward = (real)((scalar)REPEATED_AGAIN_TENTHS * S(0.1)) * more / fmax(twice + more, (real)(REAL_SMALLEST));
    color sum;
#define METAL_PART(c)                                                                                                       \
    {                                                                                                                       \
        const real dip = metal_dip(b->metal.c, b->edge.c);                                                                  \
        const real between = metal_reflects(b->metal.c, dip, o.between[0], o.between[1]);                                   \
        const real ends = metal_reflects(b->metal.c, dip, o.first[0], o.first[1])                                           \
                          * metal_reflects(b->metal.c, dip, other.first[0], other.first[1]);                                \
        const real repeats = twice + more * between * (R(1.0) - onward) / (R(1.0) - onward * between);                      \
        sum.c = single * fresnel_metal(meeting, b->metal.c, b->edge.c) + ends * repeats;                                    \
    }
    METAL_PART(r) METAL_PART(g) METAL_PART(b)
#undef METAL_PART
    return sum;
}

// What coat and fuzz leave of light that crosses the boundary.
#define THROUGH_LAYERS(b) color_scale((b)->coat_tint, (R(1.0) - (b)->coat_albedo) * (R(1.0) - (b)->fuzz_albedo))

// How much of a lobe counts, of which facets with this width reflect: sharp ones as highlights, broad ones as diffuse bodies.
INLINE real lobe_share(real broad, real sharp, real alpha) { return sharp + (broad - sharp) * alpha * alpha; }

// f * cosine, with factors on what is diffuse and on highlights; 0 for directions below the surface, unless it is glass.
INLINE color bsdf_parts(const bsdf *b, vec toward, real broad, real sharp, __global const float *tables) {
    vec i = bsdf_local(b, toward);
    const mask over = b->seen & less(R(0.0), i.z);
    color below = color_of(R(0.0), R(0.0), R(0.0));
    const mask under = b->seen & less(i.z, R(0.0));
    if (any_lane(under & less(R(0.0), b->clear.weight))) {
        const color passes = color_scale(glass_passes(&b->clear, b->out, i, tables), b->clear.weight);
        below = color_pick(under, color_scale(color_mul(passes, THROUGH_LAYERS(b)), sharp), below);
    }
    i.z = fmax(i.z, R(1e-6));
    const vec h = middle_way(b->out, i);
    const real single = ggx_value(b->out, i, h, b->alpha) * lobe_share(broad, sharp, b->alpha);
    color sum = color_of(R(0.0), R(0.0), R(0.0));
    if (any_of(b->dielectric)) {
        color body = eon_value(b->body, b->out, i, b->rough_body);
        albedo o = {R(0.0), R(0.0)}, other = o;
        real gloss = R(0.0);
        if (any_of(b->root)) {
            o = albedo_of_dielectric(tables, b->out.z, b->rough, b->root);
            other = albedo_of_dielectric(tables, i.z, b->rough, b->root);
            gloss = single * fresnel_dielectric(vec_dot(b->out, h), b->ior);
        }
        o.of_direction = pick(b->emerges, R(0.0), o.of_direction);
        body = color_scale(body, b->bare);
        sum = color_scale(color_add(color_scale(b->gloss, gloss), color_scale(body, i.z * through_boundary(o, other) * broad)),
                          b->dielectric);
    }
    if (any_of(b->clear.weight)) {
        // The tint of the boundary is that of its outer side.
        const color tint = color_pick(b->clear.inside, color_of(R(1.0), R(1.0), R(1.0)), b->gloss);
        const real facets = ggx_value(b->out, i, h, b->alpha);
        const real reflects = b->clear.weight * glass_reflects(&b->clear, b->out, i, h, facets, tables) * sharp;
        sum = color_add(sum, color_scale(tint, reflects));
    }
    if (any_of(b->metalness)) sum = color_add(sum, color_scale(metal_value(b, i, h, single, broad, tables), b->metalness));
    if (any_of(b->coat)) {
        const real facets = ggx_value(b->out, i, h, b->coat_alpha) * lobe_share(broad, sharp, b->coat_alpha);
        const real coat = b->coat * facets * fresnel_dielectric(vec_dot(b->out, h), b->coat_ior);
        sum = color_mul(sum, color_scale(b->coat_tint, R(1.0) - b->coat_albedo));
        sum = color_add(sum, color_of(coat, coat, coat));
    }
    if (any_of(brightest(b->fuzz))) {
        const real fibres = fuzz_value(b->out, i, b->fuzz_rough) * i.z * broad;
        sum = color_add(color_scale(sum, R(1.0) - b->fuzz_albedo), color_scale(b->fuzz, fibres));
    }
    return color_pick(over, sum, below);
}

// Probability per steradian with which bsdf_sample chooses a direction, with the same factors.
INLINE real bsdf_densities(const bsdf *b, vec toward, real broad, real sharp) {
    const vec i = bsdf_local(b, toward), h = middle_way(b->out, i);
    const real of_coat = b->by_coat * lobe_share(broad, sharp, b->coat_alpha), of_gloss = b->by_gloss * lobe_share(broad, sharp, b->alpha);
    real around = R(1.0) - b->by_coat - b->by_gloss - b->by_glass - b->by_beyond;
    around = pick(less(R(0.0), b->by_below), fmax(around - b->by_below, R(0.0)), around);
    const real hemisphere = broad * around * fmax(i.z, R(0.0)) / BSDF_PI;
    real facets = of_gloss, beyond = R(0.0);
    if (any_of(b->clear.weight)) {
        const glass *g = &b->clear;
        facets += b->by_glass * sharp * fresnel_across(vec_dot(b->out, h), g->mirrors);
        const vec bends = bending_facet(b->out, i, g->across);
        const real bent = b->by_glass * (R(1.0) - fresnel_across(vec_dot(b->out, bends), g->mirrors)) * bending_density(g, b->out, i, bends);
        beyond = sharp * (bent + b->by_beyond * fmax(-i.z, R(0.0)) / BSDF_PI);
    }
    const real sum = hemisphere + facets * ggx_density(b->out, h, b->alpha) + of_coat * ggx_density(b->out, h, b->coat_alpha);
    return pick(b->seen, pick(less(R(0.0), i.z), sum, pick(less(i.z, R(0.0)), beyond, R(0.0))), R(0.0));
}

// A direction chosen by three numbers in (0, 1), and whether light is scattered there.
INLINE vec bsdf_sample(const bsdf *b, real choice, real u, real v, mask *usable) {
    const mask coat = less(choice, b->by_coat), gloss = ~coat & less(choice, b->by_coat + b->by_gloss);
    const vec h = ggx_facet(b->out, pick(coat, b->coat_alpha, b->alpha), u, v), mirrored = mirrored_by(b->out, h);
    const vec around = hemisphere_direction(vec_of(R(0.0), R(0.0), R(1.0)), u, v);
    vec i = vec_pick(coat | gloss, mirrored, around);
    mask below = coat & ~coat;
    if (any_of(b->clear.weight)) {
        const real before = b->by_coat + b->by_gloss, after = before + b->by_glass;
        const mask facet = ~coat & ~gloss & less(choice, after), beyond = ~coat & ~gloss & ~facet & less(choice, after + b->by_beyond);
        const mask bends = facet & less(fresnel_across(vec_dot(b->out, h), b->clear.mirrors), (choice - before) / b->by_glass);
        i = vec_pick(bends, refracted_at(b->out, h, b->clear.across), vec_pick(facet, mirrored, i));
        i.z = pick(beyond, -i.z, i.z);
        below = bends | beyond;
    }
    // A facet that mirrors below the surface, or refracts above it, is hidden by others.
    *usable = b->seen & less(R(0.0), pick(below, -i.z, i.z));
    return vec_along(vec_along(vec_scale(b->normal, i.z), i.x, b->side), i.y, b->up);
}
