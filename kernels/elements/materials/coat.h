// A clear layer over the body: a dielectric's boundary that mirrors, and tints what crosses it, there and back.
#include "shading/bsdf_record.h"

INLINE void coat_begins(bsdf *b, const pbr *p, mask inside) {
    b->coat = p->coat_weight;
    b->coat_tint = color_mix(color_of(R(1.0), R(1.0), R(1.0)), p->coat_color, b->coat);
    b->coat_rough = p->coat_roughness;
    b->coat_facets = even_slopes(alpha_of(b->coat_rough));
    b->coat_ior = p->coat_ior;
    b->coat_root = (b->coat_ior - R(1.0)) / (b->coat_ior + R(1.0));
    b->coat_albedo = R(0.0);
    b->coat = pick(inside, R(0.0), b->coat);
    b->coat_tint = color_pick(inside, color_of(R(1.0), R(1.0), R(1.0)), b->coat_tint);
}

// What it does to the body and takes from it.
INLINE void coat_covers(bsdf *b, const pbr *p, __global const float *tables) {
    if (!any_of(b->coat)) return;
    // Light that the coat's inner side reflects meets the body again (OpenPBR 1.1, Coat darkening).
    const real inner = R(1.0) - (R(1.0) - albedo_of_dielectric(tables, R(1.0), b->coat_rough, b->coat_root).mean) / (b->coat_ior * b->coat_ior);
    const real most = b->coat * p->coat_darkening;
#define DARKENING(c) (R(1.0) - most + most * (R(1.0) - inner) / (R(1.0) - inner * (c)))
    b->body = color_of(b->body.r * DARKENING(b->body.r), b->body.g * DARKENING(b->body.g), b->body.b * DARKENING(b->body.b));
    b->below = color_of(DARKENING(p->subsurface_color.r), DARKENING(p->subsurface_color.g), DARKENING(p->subsurface_color.b));
    b->metal = b->body;
    b->coat_albedo = b->coat * albedo_of_dielectric(tables, b->out.z, b->coat_rough, b->coat_root).of_direction;
#undef DARKENING
}

// f * cosine of itself and of what is below it.
INLINE color coat_over(const bsdf *b, color below, vec i, vec h, real broad, real sharp) {
    const real facets = ggx_value(b->out, i, h, b->coat_facets) * lobe_share(broad, sharp, b->coat_facets.alpha);
    const real coat = b->coat * facets * fresnel_dielectric(vec_dot(b->out, h), b->coat_ior);
    below = color_mul(below, color_scale(b->coat_tint, R(1.0) - b->coat_albedo));
    return color_add(below, color_of(coat, coat, coat));
}
