// Rays through a grid: the data that they read, where they enter and leave, and the transfer function.
typedef struct {
    view_record view;
    __constant const struct Volume *settings;
    material_record material;
    light_record lights;
    __global const float *transfer;   // columns of TRANSFER_SIZE numbers: opacity of a step, colour, light that a step adds
    grid grid;
    __constant const struct Sampling *sampling;
    orbit_record orbits;   // the solid, and the formulas' constants; nothing where no program asks them
    constants k;
    __global const float *bounds;        // along paths: of each stored brick the most extinction that may be met in it ...
    __global const float *environment;   // ... and see environment.h
    __global const float *tables;        // of lights
    plane_set planes;
} world;

// The places of a ray, a step apart from where it enters the grid on: first + number * step, in voxels from the middle of the
// grid's first voxel.
typedef struct {
    vec first, step;
    vec per_step, passed;   // 1 / step and -first / step: a coordinate has the number coordinate * per_step + passed
    ints back[3];           // -1 where a coordinate falls, 0 where it grows
    ints octant;            // the number of its directions' octant, 0 to 7
    real near, far;         // distances along the ray; it ends before `far`
} grid_ray;

// A direction in voxels along the grid's own axes.
INLINE vec grid_own(__constant const struct Grid *about, vec a) { return vec_along_axes(about, a); }

INLINE real safe_inverse(real a) { return R(1.0) / pick(less(fabs(a), R(1e-20)), R(1e-20), a); }

// The part of a ray within the grid; lanes that miss it are not in the result.
INLINE mask enter(ray r, world w, grid_ray *g) {
    __constant const struct Grid *about = w.grid.about;
    const vec origin = grid_own(about, vec_sub(r.origin, vec_splat(about->corner)));
    const vec direction = grid_own(about, r.direction);
    const vec inverse = vec_of(safe_inverse(direction.x), safe_inverse(direction.y), safe_inverse(direction.z));
    const vec first = vec_mul(vec_scale(origin, R(-1.0)), inverse), last = vec_mul(vec_sub(vec_of_counts(about->sides), origin), inverse);
    g->near = fmax(fmax(fmin(first.x, last.x), fmin(first.y, last.y)), fmax(fmin(first.z, last.z), r.near));
    g->far = fmin(fmin(fmax(first.x, last.x), fmax(first.y, last.y)), fmin(fmax(first.z, last.z), r.far));
    const real step = (real)(w.settings->step), steps = R(1.0) / step;
    g->first = vec_sub(vec_along(origin, g->near, direction), vec_of(R(0.5), R(0.5), R(0.5)));
    g->step = vec_scale(direction, step);
    g->per_step = vec_scale(inverse, steps);
    g->passed = vec_mul(vec_scale(g->first, R(-1.0)), g->per_step);
    g->back[0] = less_equal(direction.x, R(0.0));
    g->back[1] = less_equal(direction.y, R(0.0));
    g->back[2] = less_equal(direction.z, R(0.0));
    g->octant = (g->back[0] & 1) + (g->back[1] & 2) + (g->back[2] & 4);
    return less(g->near, g->far);
}

INLINE vec place_of(grid_ray r, real number) { return vec_along(r.first, number, r.step); }
INLINE real distance_of(grid_ray r, real number, world w) { return r.near + number * (real)(w.settings->step); }

// The number of the first place past a cube that begins at the node of 1 << shift cells around a cell, and goes `side` such
// nodes in the ray's directions; but at least the next one. (What lies on the cube's far side belongs to it.)
INLINE real leave(grid_ray r, real number, cell c, ints shift, ints side) {
    // `side` where the coordinate grows, 1 - side where it falls.
    const ints x = (c.x >> shift) + (side ^ r.back[0]) - 2 * r.back[0];
    const ints y = (c.y >> shift) + (side ^ r.back[1]) - 2 * r.back[1];
    const ints z = (c.z >> shift) + (side ^ r.back[2]) - 2 * r.back[2];
    const real first = least(to_reals(x << shift) * r.per_step.x + r.passed.x,
                             least(to_reals(y << shift) * r.per_step.y + r.passed.y,
                                   to_reals(z << shift) * r.per_step.z + r.passed.z));
    return to_reals(to_ints(most(first, number))) + R(1.0);
}

// Looks at the place of each moving lane: those in the result are where something may be seen, and have a value. `onward`: the place
// to which lanes can go on; those past the ray's end move no more.
INLINE mask look(grid_ray r, real number, mask *moving, world w, real *value, real *onward, real *steps) {
    *moving &= less(distance_of(r, number, w), r.far);
    *steps += pick(*moving, R(1.0), R(0.0));
    const cell c = cell_at(place_of(r, number), w.grid.about);
    const ints entry = brick_at(c, w.grid);
    const mask stored = is_stored(entry);
    const ints digits = (~entry >> r.octant) & 0x010101;
    ints shift = (ints)(3), side = (ints)(1) << ((digits | digits >> 7 | digits >> 14) & 7);
    mask seen = stored & ~stored;
    if (any_lane(stored)) {
        const ints octant = octant_at(c, entry, stored, w.grid, &seen);
        shift = pick_ints(stored, pick_ints(equal_ints(octant, (ints)(0)), (ints)(2), (ints)(1)), shift);
        side = pick_ints(stored, (ints)(1), side);
    }
    *onward = leave(r, number, c, shift, side);
    seen &= *moving;
    if (!any_lane(seen)) return seen;
    *value = grid_value(c, entry, seen, w.grid);
    *onward = pick(seen, number + R(1.0), *onward);
    return seen;
}

// The value at a place of a ray; 0 where no brick is stored.
INLINE mask value_met(grid_ray r, real number, mask active, world w, real *value) {
    const cell c = cell_at(place_of(r, number), w.grid.about);
    const ints entry = brick_at(c, w.grid);
    const mask stored = active & is_stored(entry);
    *value = pick(stored, grid_value(c, entry, stored, w.grid), R(0.0));
    return stored;
}

// A place in the transfer table.
typedef struct {
    ints first;
    real share;
} transfer_place;

INLINE transfer_place transfer_at(real value, __constant const struct Volume *settings) {
    const real place = clamp((value - (real)(settings->low)) * (real)(settings->range), R(0.0), R(1.0));
    const real at = place * (real)((scalar)(TRANSFER_SIZE - 1));
    const ints first = min(to_ints(at), (ints)(TRANSFER_SIZE - 2));
    return (transfer_place){first, at - to_reals(first)};
}

INLINE real transfer_column(transfer_place p, int column, __global const float *transfer) {
    transfer += column * TRANSFER_SIZE;
    return between(gather_floats(transfer, p.first), gather_floats(transfer, p.first + 1), p.share);
}

// The opacity of a step where the value is this; of paths the extinction.
INLINE real opacity_of(real value, world w) { return transfer_column(transfer_at(value, w.settings), 0, w.transfer); }

// The light that a step adds by itself where the value is this; there is none unless the grid `shines`.
INLINE color emission_of(real value, world w) {
    const transfer_place p = transfer_at(value, w.settings);
    return color_of(transfer_column(p, 4, w.transfer), transfer_column(p, 5, w.transfer), transfer_column(p, 6, w.transfer));
}

// The colour of a value, or that of a normal: the thesis's (n + 1) / 2.
INLINE color tint_of(real value, vec normal, world w) {
    if (w.material->of_volumes) return surface_color(normal, value, w.material, w.transfer);
    if (!w.settings->tinted) {
        __global const float *same = w.transfer + TRANSFER_SIZE;
        return color_of((real)((scalar)same[0]), (real)((scalar)same[TRANSFER_SIZE]), (real)((scalar)same[2 * TRANSFER_SIZE]));
    }
    const transfer_place p = transfer_at(value, w.settings);
    return color_of(transfer_column(p, 1, w.transfer), transfer_column(p, 2, w.transfer), transfer_column(p, 3, w.transfer));
}

// A place without a normal faces the viewer, and so does the far side of what is transparent.
INLINE vec facing_normal(vec normal, vec to_viewer) {
    const mask none = less(vec_dot(normal, normal), R(0.5));
    const mask away = less(vec_dot(normal, to_viewer), R(0.0));
    return vec_pick(none, to_viewer, vec_pick(away, vec_scale(normal, R(-1.0)), normal));
}
