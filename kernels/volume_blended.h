// Normals of the surface in a grid: those of the samples around a place, blended.
INLINE vec normal_there(vec point, vec blended, mask active, world w) { return blended; }
