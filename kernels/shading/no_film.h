// Materials without a film: what bsdf.h asks of one is nothing, and nothing of it is left in the texts of stages that include this.
#include "shading/bsdf.h"

INLINE void film_begins(bsdf *b, const pbr *p, __global const float *tables) {}
INLINE color film_again(const bsdf *b) { return b->metal; }
INLINE real film_mirrored(const bsdf *b, real share) { return share; }
INLINE color film_passed(const bsdf *b, color body) { return body; }
INLINE void film_adds(const bsdf *b, vec toward, vec i, vec h, real single, real sharp, __global const float *tables, color *over,
                      color *below) {
}
