// The material of a spot: what paths scatter by.

INLINE pbr pbr_at(const spot *here, world w) { return pbr_of(w.materials, here->tint); }
