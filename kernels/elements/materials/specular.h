// The boundary of a body: how wide its highlights are, a metal's and glass's too, and what it mirrors as a dielectric.
#include "shading/bsdf_record.h"

// Facets that are drawn out along a tangent, as stages include them behind bsdf.h: `costly/specular.h`, or `plain_materials.h`. It draws out
// those of a base, and its frame; and it says by which factors what they reflect in all differs from what even ones do: of glass from
// outside (table 1) and from within (2), and of dielectrics by the root of their reflectance (from 3 on); and of what metals reflect again.
INLINE void specular_draws_out(bsdf *b, const pbr *p, vec normal);
INLINE albedo specular_drawn(albedo even, real table, slopes facets, real rough, vec from, __global const float *tables);
INLINE repeated specular_drawn_again(repeated even, slopes facets, real rough, vec from, __global const float *tables);

// Also the frame of all lobes, since facets may have a direction in it.
INLINE void specular_begins(bsdf *b, const pbr *p, vec normal) {
    make_frame(normal, &b->side, &b->up);
    b->rough = p->specular_roughness;
    b->facets = even_slopes(alpha_of(b->rough));
    specular_draws_out(b, p, normal);
    b->gloss = b->edge = p->specular_color;
    b->root = fmin((p->specular_ior - R(1.0)) / (p->specular_ior + R(1.0)) * sqrt(p->specular_weight), R(0.98));
    b->ior = (R(1.0) + b->root) / (R(1.0) - b->root);
}

// What a dielectric's boundary reflects of light from a direction.
INLINE albedo specular_albedo(const bsdf *b, vec from, __global const float *tables) {
    const albedo a = albedo_of_dielectric(tables, from.z, b->rough, b->root);
    return specular_drawn(a, R(3.0) + fmax(b->root - R(0.2), R(0.0)) / R(0.3), b->facets, b->rough, from, tables);
}

// What rough glass mirrors and refracts of light from a direction, in all; `side` 1: from within.
INLINE albedo specular_passed(slopes facets, real rough, real root, vec from, int side, __global const float *tables) {
    const albedo a = albedo_of_root(tables + (side ? ALBEDO_GLASS_INSIDE : ALBEDO_GLASS), from.z, rough, sqrt(root));
    return specular_drawn(a, (real)((scalar)(1 + side)), facets, rough, from, tables);
}

// What a metal's facets do to light that meets several of them.
INLINE repeated specular_repeats(const bsdf *b, vec from, __global const float *tables) {
    return specular_drawn_again(repeated_at(tables, from.z, b->rough), b->facets, b->rough, from, tables);
}

// What a body's boundary lets in and out.
INLINE real through_boundary(albedo o, albedo i) {
    return (R(1.0) - o.of_direction) * (R(1.0) - i.of_direction) / fmax(R(1.0) - o.mean, R(1e-6));
}
