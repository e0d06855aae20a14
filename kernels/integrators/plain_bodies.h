// Clear bodies that are levels and balls: to what `chains.h` and `bent_ways.h` ask of other shapes the answer is nothing, and nothing of them is
// left in the texts of stages that include this.
#include "integrators/chains.h"

INLINE int is_shot(object_record o) { return 0; }
CALLED real shape_crossed(object_record o, const vec *from, const vec *way, int leaves) { return R(-1.0); }
INLINE chain_site shape_site_at(object_record o, vec place) {
    const vec none = vec_of(R(0.0), R(0.0), R(0.0));
    return (chain_site){none, R(0.0), R(0.0), R(0.0), R(1.0), none};
}
INLINE vec shape_site_turns(object_record o, const chain_site *s, vec way) { return vec_of(R(0.0), R(0.0), R(0.0)); }
INLINE mask shape_chain(object_record o, const facets *f, real index, const vec *from, const chain_end *end, real least, bits seed, mask wanted,
                        vec *toward, real *chances) {
    return wanted & ~wanted;
}
