// What a flight through a grid in bricks may meet, see `volume_track.h`.
#define NUDGE R(0.002)          // past a brick's side, in sides of a voxel

// The number at which a ray leaves the node of 1 << shift cells around a cell, `side` such nodes on; never past the outermost middles,
// beyond which their values go on.
INLINE real axis_left(ints at, ints shift, ints side, ints back, int sides, real per_step, real passed) {
    const ints edge = (((at >> shift) + (side ^ back) - 2 * back) << shift);
    const real place = to_reals(edge);
    const mask inner = less(R(0.0), place) & less(place, (real)((scalar)(sides - 1)));
    return pick(inner, place * per_step + passed, (real)(REAL_LARGEST));
}

INLINE real bound_at(grid_ray r, real number, mask active, world w, real *until) {
    const cell c = cell_at(place_of(r, number + NUDGE), w.grid.about);
    const ints entry = brick_at(c, w.grid);
    const mask stored = is_stored(entry);
    const ints digits = (~entry >> r.octant) & 0x010101;
    const ints side = pick_ints(stored, (ints)(1), (ints)(1) << ((digits | digits >> 7 | digits >> 14) & 7));
    const ints shift = (ints)(3);
    const real x = axis_left(c.x, shift, side, r.back[0], w.grid.about->sides[0], r.per_step.x, r.passed.x);
    const real y = axis_left(c.y, shift, side, r.back[1], w.grid.about->sides[1], r.per_step.y, r.passed.y);
    const real z = axis_left(c.z, shift, side, r.back[2], w.grid.about->sides[2], r.per_step.z, r.passed.z);
    const real first = least(x, y);
    *until = most(least(first, z), number + NUDGE);
    return pick(stored & active, gather_floats(w.bounds, pick_ints(stored, entry, (ints)(0))), R(0.0));
}

INLINE real extinction_at(grid_ray r, real value, world w) { return opacity_of(value, w); }
INLINE int shines_itself(world w) { return w.settings->shines; }
