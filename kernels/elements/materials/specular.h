// The boundary of a body: how wide its highlights are, a metal's and glass's too, and what it mirrors as a dielectric.
#include "shading/bsdf_record.h"

// Also the frame of all lobes, since facets may have a direction in it.
INLINE void specular_begins(bsdf *b, const pbr *p, vec normal) {
    make_frame(normal, &b->side, &b->up);
    b->rough = p->specular_roughness;
    b->facets = even_slopes(alpha_of(b->rough));
    b->gloss = b->edge = p->specular_color;
    b->root = fmin((p->specular_ior - R(1.0)) / (p->specular_ior + R(1.0)) * sqrt(p->specular_weight), R(0.98));
    b->ior = (R(1.0) + b->root) / (R(1.0) - b->root);
}

// What a dielectric's boundary reflects of light from a direction.
INLINE albedo specular_albedo(const bsdf *b, vec from, __global const float *tables) {
    return albedo_of_dielectric(tables, from.z, b->rough, b->root);
}

// What rough glass mirrors and refracts of light from a direction, in all; `side` 1: from within.
INLINE albedo specular_passed(slopes facets, real rough, real root, vec from, int side, __global const float *tables) {
    return albedo_of_root(tables + (side ? ALBEDO_GLASS_INSIDE : ALBEDO_GLASS), from.z, rough, sqrt(root));
}

// What a metal's facets do to light that meets several of them.
INLINE repeated specular_repeats(const bsdf *b, vec from, __global const float *tables) {
    return repeated_at(tables, from.z, b->rough);
}

// What a body's boundary lets in and out.
INLINE real through_boundary(albedo o, albedo i) {
    return (R(1.0) - o.of_direction) * (R(1.0) - i.of_direction) / fmax(R(1.0) - o.mean, R(1e-6));
}
