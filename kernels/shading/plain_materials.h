// Materials without a film and with even facets: to what bsdf.h and specular.h ask of these the answer is nothing, and nothing of them is left
// in the texts of stages that include this.
#include "shading/bsdf.h"

INLINE void film_begins(bsdf *b, const pbr *p, __global const float *tables) {}
INLINE color film_again(const bsdf *b) { return b->metal; }
INLINE real film_mirrored(const bsdf *b, real share) { return share; }
INLINE color film_passed(const bsdf *b, color body) { return body; }
INLINE void film_adds(const bsdf *b, vec toward, vec i, vec h, real single, real sharp, __global const float *tables, color *over,
                      color *below) {
}

INLINE void specular_draws_out(bsdf *b, const pbr *p, vec normal) {}
INLINE albedo specular_drawn(albedo even, real table, slopes facets, real rough, vec from, __global const float *tables) { return even; }
INLINE repeated specular_drawn_again(repeated even, slopes facets, real rough, vec from, __global const float *tables) { return even; }
