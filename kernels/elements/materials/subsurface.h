// Boundaries that light goes below and comes from: what a material's layers are for it.
#include "shading/bsdf_record.h"

// Where light comes out, `emerges`, the boundary lets it through as that of a white diffuse body does, and there is nothing over it: what
// lies there was reckoned where light went in. From inside glass nothing goes below its boundary.
INLINE void below_begins(bsdf *b, const pbr *p, mask inside) {
    const color white = color_of(R(1.0), R(1.0), R(1.0)), none = color_of(R(0.0), R(0.0), R(0.0));
    b->emerges = less(R(0.5), p->emerges);
    b->bare = R(1.0);
    b->below = white;
    if (!any_of(p->subsurface_weight) && !any_lane(b->emerges)) return;
    b->bare = R(1.0) - pick(b->emerges | inside, R(0.0), p->subsurface_weight);
    b->out = vec_pick(b->emerges, vec_of(R(0.0), R(0.0), R(1.0)), b->out);
    b->body = color_pick(b->emerges, white, b->body);
    b->gloss = color_pick(b->emerges, none, b->gloss);
    b->rough_body = pick(b->emerges, R(0.0), b->rough_body);
    b->metalness = pick(b->emerges, R(0.0), b->metalness);
    b->clear.weight = pick(b->emerges, R(0.0), b->clear.weight);
    b->dielectric = pick(b->emerges, R(1.0), b->dielectric);
    b->coat = pick(b->emerges, R(0.0), b->coat);
    b->coat_tint = color_pick(b->emerges, white, b->coat_tint);
    b->fuzz = color_pick(b->emerges, none, b->fuzz);
}

// How likely light goes below the boundary, beside what is `scattered`, which loses that part of the body.
INLINE real below_sampled(const bsdf *b, real of_gloss, real *scattered) {
    const real enters = b->dielectric * (R(1.0) - of_gloss), sinks = enters * (R(1.0) - b->bare);
    *scattered += sinks - sinks * fmax(luminance(b->body), R(0.02));
    return sinks;
}
