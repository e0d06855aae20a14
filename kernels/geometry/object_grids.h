// Volumes among the objects: values on a grid, linear along each axis between the middles of eight voxels. What all grids have lies in
// one buffer (`clfractal/geometry/object_grids.py`): values, x fastest, and of each brick of 8 x 8 x 8 cells its least and its largest
// one. The cells at the rim go half a voxel beyond the outermost middles, where values go on as they are.
#include "device/gather.h"
#include "geometry/object_span.h"

#define GRID_NUDGE R(0.002)   // past a side, so that a place is beyond it in spite of rounding; in sides of a voxel
#define ROOT_STEPS 64    // at most: so many halves are more than a number has digits

// The part of a ray in a grid's box: first + number * step, in voxels from the middle of the first one. From one number to the next the
// way is `voxel` long.
typedef struct {
    object_record o;
    __global const float *tables;
    vec first, step, inverse;   // `inverse` is 1 / step
    mask begins_outside;
    real near, far;             // along the ray: in the box
    real end;                   // the number at `far`
} grid_ray;

INLINE grid_ray grid_ray_of(object_record o, __global const float *tables, span inside, vec origin, vec direction, real far) {
    grid_ray g;
    const real voxel = (real)(o->voxel);
    g.o = o;
    g.tables = tables;
    g.begins_outside = less(R(0.0), inside.entry);
    g.near = fmax(inside.entry, R(0.0));
    g.far = fmin(inside.exit, far);
    g.end = (g.far - g.near) / voxel;
    const vec middle = vec_scale(vec_of_counts(o->grid_sides), R(0.5));
    // From where the ray enters, so that places have no rounding of the way there.
    const vec begin = vec_sub(vec_along(origin, g.near, direction), vec_splat(o->middle));
    const vec own = object_own(o, begin), way = object_own(o, vec_scale(direction, voxel));
    g.first = vec_of((own.x + R(1.0)) * middle.x - R(0.5), (own.y + R(1.0)) * middle.y - R(0.5), (own.z + R(1.0)) * middle.z - R(0.5));
    g.step = vec_mul(way, middle);
    g.inverse = vec_of(R(1.0) / divisor(g.step.x), R(1.0) / divisor(g.step.y), R(1.0) / divisor(g.step.z));
    return g;
}

INLINE vec grid_place(const grid_ray *g, real number) { return vec_along(g->first, number, g->step); }

// A cell by its numbers from -1, and its brick's number.
typedef struct {
    ints x, y, z;
} grid_cell;

// (NaN, in lanes without a ray, is in a cell too: nothing is read past the grid.)
INLINE ints cell_of(real place, int count) {
    const real from_rim = pick(is_nan(place), R(0.0), place + R(1.0));
    return to_ints(clamp(from_rim, R(0.0), (real)((scalar)count) + R(0.5))) - 1;
}

INLINE grid_cell grid_cell_at(vec p, object_record o) {
    return (grid_cell){cell_of(p.x, o->grid_sides[0]), cell_of(p.y, o->grid_sides[1]), cell_of(p.z, o->grid_sides[2])};
}

INLINE ints brick_of(grid_cell c, object_record o) {
    const int row = (o->grid_sides[0] + 8) >> 3, layer = row * ((o->grid_sides[1] + 8) >> 3);
    return ((c.z + 1) >> 3) * layer + (((c.y + 1) >> 3) * row + ((c.x + 1) >> 3));
}

// The number at which a ray leaves a brick, or a cell of lanes `fine`, along one axis.
INLINE real axis_end(ints cell, mask fine, real first, real inverse) {
    const mask grows = less(R(0.0), inverse);
    const ints brick = (((cell + 1) >> 3) << 3) - 1;
    const ints low = pick_ints(fine, cell, brick), side = pick_ints(fine, (ints)(1), (ints)(8));
    return (to_reals(low + (side & grows)) - first) * inverse;
}

// The number at which a ray leaves a brick, or a cell of lanes `fine`; it always grows.
INLINE real grid_cell_end(const grid_ray *g, grid_cell c, mask fine, real number) {
    const real x = axis_end(c.x, fine, g->first.x, g->inverse.x), y = axis_end(c.y, fine, g->first.y, g->inverse.y);
    return fmax(fmin(fmin(x, y), axis_end(c.z, fine, g->first.z, g->inverse.z)), number + GRID_NUDGE);
}

// The values at a cell's corners, x fastest.
INLINE void grid_corners(grid_cell c, object_record o, __global const float *tables, real *corners) {
    const int row = o->grid_sides[0], layer = row * o->grid_sides[1];
    const ints zero = (ints)(0);
    const ints x0 = max(c.x, zero), x1 = min(c.x + 1, (ints)(row - 1));
    const ints y0 = max(c.y, zero) * row, y1 = min(c.y + 1, (ints)(o->grid_sides[1] - 1)) * row;
    const ints z0 = max(c.z, zero) * layer, z1 = min(c.z + 1, (ints)(o->grid_sides[2] - 1)) * layer;
    __global const float *values = tables + o->grid;
    for (int i = 0; i < TURNS(8); ++i) {
        corners[i] = gather_floats(values, ((i & 4) ? z1 : z0) + (((i & 2) ? y1 : y0) + ((i & 1) ? x1 : x0)));
    }
}

// The value at a place.
INLINE real grid_value(vec p, object_record o, __global const float *tables) {
    real v[8];
    const grid_cell c = grid_cell_at(p, o);
    grid_corners(c, o, tables, v);
    const real x = clamp(p.x - to_reals(c.x), R(0.0), R(1.0)), y = clamp(p.y - to_reals(c.y), R(0.0), R(1.0));
    const real z = clamp(p.z - to_reals(c.z), R(0.0), R(1.0));
    const real low = between(between(v[0], v[1], x), between(v[2], v[3], x), y);
    return between(low, between(between(v[4], v[5], x), between(v[6], v[7], x), y), z);
}

// What the value over the level is along a ray in one cell: a polynomial of the third degree, c[0] + r (c[1] + r (c[2] + r c[3])) at r past
// a number (Marmitt and others 2004, Fast and accurate ray-voxel intersection techniques).
INLINE void cell_polynomial(const grid_ray *g, grid_cell cell, real number, real *c) {
    real v[8];
    grid_corners(cell, g->o, g->tables, v);
    const vec p = grid_place(g, number);
    const real x = p.x - to_reals(cell.x), y = p.y - to_reals(cell.y), z = p.z - to_reals(cell.z), level = (real)(g->o->level);
    // Along x the four edges are linear, along y two faces are quadratic.
    real edge[4][2], face[2][3];
    for (int i = 0; i < TURNS(4); ++i) {
        const real rise = v[2 * i + 1] - v[2 * i];
        edge[i][0] = (v[2 * i] - level) + rise * x;
        edge[i][1] = rise * g->step.x;
    }
    for (int i = 0; i < TURNS(2); ++i) {
        const real a = edge[2 * i + 1][0] - edge[2 * i][0], b = edge[2 * i + 1][1] - edge[2 * i][1];
        face[i][0] = edge[2 * i][0] + a * y;
        face[i][1] = edge[2 * i][1] + (b * y + a * g->step.y);
        face[i][2] = b * g->step.y;
    }
    const real a = face[1][0] - face[0][0], b = face[1][1] - face[0][1], d = face[1][2] - face[0][2];
    c[0] = face[0][0] + a * z;
    c[1] = face[0][1] + (b * z + a * g->step.z);
    c[2] = face[0][2] + (d * z + b * g->step.z);
    c[3] = d * g->step.z;
}

INLINE real polynomial_at(const real *c, real r) { return ((c[3] * r + c[2]) * r + c[1]) * r + c[0]; }

// The first place in 0 to `length` from which on a polynomial is on the other side of 0 than `inside`; the result says in which lanes.
INLINE mask polynomial_root(const real *c, real length, mask inside, mask here, real *root) {
    // Between its turning points, the roots of c[1] + 2 c[2] r + 3 c[3] r^2, it only rises or only falls.
    const real square = c[2] * c[2] - R(3.0) * c[3] * c[1], sum = -(c[2] + copysign(sqrt(fmax(square, R(0.0))), c[2]));
    const real one = sum / divisor(R(3.0) * c[3]), other = c[1] / divisor(sum);
    const mask turns = less(R(0.0), square);
    const real ends[4] = {R(0.0), pick(turns, clamp(fmin(one, other), R(0.0), length), R(0.0)),
                          pick(turns, clamp(fmax(one, other), R(0.0), length), R(0.0)), length};
    real low = R(0.0), high = length;
    mask found = here & ~here;
    for (int i = 0; i < TURNS(4); ++i) {
        const mask crosses = here & ~found & (less_equal(R(0.0), polynomial_at(c, ends[i])) ^ inside);
        low = pick(crosses, ends[i > 0 ? i - 1 : 0], low);
        high = pick(crosses, ends[i], high);
        found |= crosses;
    }
    // Newton's steps, or halves where they leave the bracket; lanes that are there wait for the others.
    real at = R(0.5) * (low + high);
    mask moves = found;
    for (int i = 0; i < ROOT_STEPS && any_lane(moves); ++i) {
        const real value = polynomial_at(c, at), slope = (R(3.0) * c[3] * at + R(2.0) * c[2]) * at + c[1];
        const mask past = less_equal(R(0.0), value) ^ inside;
        high = pick(past, at, high);
        low = pick(past, low, at);
        const real newton = at - value / divisor(slope);
        const mask usable = less(low, newton) & less(newton, high);
        const real next = pick(usable, newton, R(0.5) * (low + high));
        const mask far = less(R(2.0) * (real)(REAL_EPSILON) * (R(1.0) + at), fabs(next - at));
        at = pick(moves, next, at);
        moves &= far;
    }
    *root = at;
    return found;
}

// How far along a ray the surface of a volume is, or the largest number: where the value passes the level, or where the box cuts what is
// above it.
INLINE real level_met(object_record o, __global const float *tables, vec origin, vec direction, real far) {
    const span box = grid_span(o, origin, direction);
    const grid_ray g = grid_ray_of(o, tables, box, origin, direction, far);
    const real voxel = (real)(o->voxel), level = (real)(o->level);
    mask active = less(box.entry, box.exit) & less(g.near, g.far);
    real met = (real)(REAL_LARGEST), number = R(0.0);
    if (!any_lane(active)) return met;
    mask inside = active & ~g.begins_outside;
    if (any_lane(inside)) inside &= less_equal(level, grid_value(g.first, o, tables));
    __global const float *ranges = tables + o->bricks;
    const int most = 8 * (o->grid_sides[0] + o->grid_sides[1] + o->grid_sides[2]) + 64;
    for (int i = 0; i < most; ++i) {
        const grid_cell c = grid_cell_at(grid_place(&g, number + GRID_NUDGE), o);
        const ints brick = 2 * brick_of(c, o);
        const mask above = less_equal(level, gather_floats(ranges, brick)), some = less_equal(level, gather_floats(ranges, brick + 1));
        const mask fine = active & some & ~above;
        const real until = fmin(grid_cell_end(&g, c, fine, number), g.end);
        // In a brick of one side only its first place can be the surface: what is said there differs from what came before.
        mask found = active & ~fine & (above ^ inside);
        real root = R(0.0);
        if (any_lane(fine)) {
            real polynomial[4];
            cell_polynomial(&g, c, number, polynomial);
            found |= polynomial_root(polynomial, until - number, inside, fine, &root);
            root = pick(fine, root, R(0.0));
        }
        met = pick(found, g.near + (number + root) * voxel, met);
        active &= ~found;
        number = until;
        const mask out = active & less_equal(g.end, number);
        // A wall of the box, not the end of the ray.
        met = pick(out & inside & less_equal(box.exit, far), g.far, met);
        active &= ~out;
        if (!any_lane(active)) break;
    }
    return met;
}

// The normal in units of the box, away from larger values: by differences over two voxels, as far as there are any; on a wall of the box
// that of the wall.
INLINE vec level_normal(object_record o, __global const float *tables, vec own, real slack) {
    real rise[3];
    const real place[3] = {own.x, own.y, own.z};
    for (int axis = 0; axis < TURNS(3); ++axis) {
        real side[2], at[2];
        const real most = (real)((scalar)(o->grid_sides[axis] - 1)), middle = R(0.5) * (most + R(1.0));
        for (int i = 0; i < TURNS(2); ++i) {
            real p[3];
            for (int k = 0; k < TURNS(3); ++k) p[k] = (place[k] + R(1.0)) * (R(0.5) * (real)((scalar)o->grid_sides[k])) - R(0.5);
            p[axis] = clamp(p[axis] + (i ? R(1.0) : R(-1.0)), R(0.0), most);
            at[i] = p[axis];
            side[i] = grid_value(vec_of(p[0], p[1], p[2]), o, tables);
        }
        const real apart = at[1] - at[0];
        rise[axis] = pick(less(R(0.0), apart), (side[0] - side[1]) * middle / fmax(apart, R(1e-6)), R(0.0));
    }
    const mask wall = less(R(1.0) - slack, fmax(fmax(fabs(own.x), fabs(own.y)), fabs(own.z)));
    return vec_pick(wall, box_normal(vec_splat(o->form), own), vec_of(rise[0], rise[1], rise[2]));
}
