// Rays through a grid: what they read, where they enter and leave, and what values look like.
typedef struct {
    __constant const struct View *view;
    __constant const struct Volume *settings;
    __constant const struct Material *material;
    __constant const struct Light *lights;
    __global const float *transfer;   // TRANSFER_SIZE entries: opacity of a step, red, green, blue
    grid grid;
#if PLANES > 0
    plane_set planes;
#endif
} world;

// A ray in the grid's own measure: voxels from its corner, per scene unit of the ray.
typedef struct {
    vec origin, direction, inverse;
    real near, far;
} grid_ray;

INLINE real safe_inverse(real a) { return R(1.0) / pick(less(fabs(a), R(1e-20)), R(1e-20), a); }

// The part of a ray within the grid; lanes that miss it are not in the result.
INLINE mask enter(ray r, __constant const struct Grid *about, grid_ray *g) {
    const vec scale = vec_splat(about->scale);
    const vec offset = vec_sub(r.origin, vec_splat(about->corner));
    g->origin = vec_of(offset.x * scale.x, offset.y * scale.y, offset.z * scale.z);
    g->direction = vec_of(r.direction.x * scale.x, r.direction.y * scale.y, r.direction.z * scale.z);
    g->inverse = vec_of(safe_inverse(g->direction.x), safe_inverse(g->direction.y), safe_inverse(g->direction.z));
    const vec first = vec_of(-g->origin.x * g->inverse.x, -g->origin.y * g->inverse.y, -g->origin.z * g->inverse.z);
    const vec last = vec_of(((real)((scalar)about->sides[0]) - g->origin.x) * g->inverse.x,
                            ((real)((scalar)about->sides[1]) - g->origin.y) * g->inverse.y,
                            ((real)((scalar)about->sides[2]) - g->origin.z) * g->inverse.z);
    g->near = fmax(fmax(fmin(first.x, last.x), fmin(first.y, last.y)), fmax(fmin(first.z, last.z), r.near));
    g->far = fmin(fmin(fmax(first.x, last.x), fmax(first.y, last.y)), fmin(fmax(first.z, last.z), r.far));
    return less(g->near, g->far);
}

// Where the ray leaves the empty node of 8 << level cells around a cell.
INLINE real leave(grid_ray r, cell c, ints level) {
    const ints shift = level + 3;
    const ints size = (ints)(1) << shift;
    const vec low = vec_of(to_reals((c.x >> shift) << shift), to_reals((c.y >> shift) << shift), to_reals((c.z >> shift) << shift));
    const real side = to_reals(size);
    // Cells begin at the middles of voxels.
    const real x = (low.x + R(0.5) + pick(less(R(0.0), r.direction.x), side, R(0.0)) - r.origin.x) * r.inverse.x;
    const real y = (low.y + R(0.5) + pick(less(R(0.0), r.direction.y), side, R(0.0)) - r.origin.y) * r.inverse.y;
    const real z = (low.z + R(0.5) + pick(less(R(0.0), r.direction.z), side, R(0.0)) - r.origin.z) * r.inverse.z;
    return fmin(x, fmin(y, z));
}

// The number of the first place at or past `t`, but at least the next.
INLINE real next_place(real t, real near, real steps, real number) {
    return fmax(ceil((t - near) * steps), number + R(1.0));
}

// What a value looks like: the opacity of a step, and a colour.
INLINE color transfer_at(real value, __constant const struct Volume *settings, __global const float *transfer, real *opacity) {
    const real place = clamp((value - (real)(settings->low)) * (real)(settings->range), R(0.0), R(1.0));
    const real at = place * (real)((scalar)(TRANSFER_SIZE - 1));
    const ints first = min(to_ints(at), (ints)(TRANSFER_SIZE - 2));
    const real share = at - to_reals(first);
    *opacity = between(gather_floats(transfer, 4 * first), gather_floats(transfer, 4 * first + 4), share);
    return color_of(between(gather_floats(transfer, 4 * first + 1), gather_floats(transfer, 4 * first + 5), share),
                    between(gather_floats(transfer, 4 * first + 2), gather_floats(transfer, 4 * first + 6), share),
                    between(gather_floats(transfer, 4 * first + 3), gather_floats(transfer, 4 * first + 7), share));
}
