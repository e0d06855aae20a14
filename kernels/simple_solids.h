// Planes, balls, boxes and cylinders that are joined to formulas: how far a place is from one, and on which side. And what is known of
// a place and any one solid.
INLINE vec solid_own(__constant const struct Orbit *o, vec point) {
    const vec a = vec_sub(point, vec_splat(o->middle));
    return vec_of(vec_dot(a, vec_splat(o->own_x)), vec_dot(a, vec_splat(o->own_y)), vec_dot(a, vec_splat(o->own_z)));
}

// A gradient in its own units as a direction of space.
INLINE vec solid_turned(__constant const struct Orbit *o, vec own) {
    const vec x = vec_scale(vec_splat(o->own_x), own.x), y = vec_scale(vec_splat(o->own_y), own.y);
    return vec_normalize(vec_add(vec_add(x, y), vec_scale(vec_splat(o->own_z), own.z)));
}

// What is known of a point and one solid, or of several: how far it is at least, below 0 in simple solids, and at most. These differ in
// hollows only, where nobody knows how far the wall is. `near`: how near its surface may be, the same number but where only the ball
// around a formula is known. That is no surface: `near` is beyond all there. `apart`: by which the nearest of several is chosen.
typedef struct {
    real far, most, near, apart, scale;
    mask inside;
    surface_point surface;
} solid_found;

INLINE real above_length(real a, real b, real c) {
    const real x = fmax(a, R(0.0)), y = fmax(b, R(0.0)), z = fmax(c, R(0.0));
    return sqrt(x * x + y * y + z * z);
}

// A plane, ball, box or cylinder, in whose own units its sides are at -1 and 1. With unequal factors along its axes the distances of
// balls and cylinders are too small, but not their directions.
INLINE void solid_simple(__constant const struct Orbit *o, vec own, solid_found *found) {
    const real sx = (real)(o->sides[0]), sy = (real)(o->sides[1]), sz = (real)(o->sides[2]);
    vec n = vec_of(R(0.0), R(0.0), R(1.0));
    if (o->kind == SOLID_PLANE) {
        found->far = own.z;
    } else if (o->kind == SOLID_SPHERE) {
        found->far = (sqrt(vec_dot(own, own)) - R(1.0)) * fmin(fmin(sx, sy), sz);
        n = own;
    } else if (o->kind == SOLID_BOX) {
        const real x = (fabs(own.x) - R(1.0)) * sx, y = (fabs(own.y) - R(1.0)) * sy, z = (fabs(own.z) - R(1.0)) * sz;
        const real within = fmax(fmax(x, y), z);
        found->far = above_length(x, y, z) + fmin(within, R(0.0));
        // Outside towards the nearest place of the box, inside to its nearest side. (In its own units, so by its sides once more.)
        const mask out = less(R(0.0), within);
        const real least = pick(out, R(0.0), within);
        n.x = copysign(pick(less(x, least), R(0.0), pick(out, x, R(1.0))) * sx, own.x);
        n.y = copysign(pick(less(y, least), R(0.0), pick(out, y, R(1.0))) * sy, own.y);
        n.z = copysign(pick(less(z, least), R(0.0), pick(out, z, R(1.0))) * sz, own.z);
    } else {
        const real arm = sqrt(own.x * own.x + own.y * own.y), thin = fmin(sx, sy);
        const real side = (arm - R(1.0)) * thin, lid = (fabs(own.z) - R(1.0)) * sz, within = fmax(side, lid);
        found->far = above_length(side, lid, R(0.0)) + fmin(within, R(0.0));
        const mask out = less(R(0.0), within);
        const real across = pick(out, fmax(side, R(0.0)), pick(less(lid, side), R(1.0), R(0.0))) * thin / fmax(arm, R(1e-30));
        const real along = pick(out, fmax(lid, R(0.0)), pick(less(lid, side), R(0.0), R(1.0))) * sz;
        n = vec_of(across * own.x, across * own.y, copysign(along, own.z));
    }
    found->inside = less_equal(found->far, R(0.0));
    found->surface.gradient = solid_turned(o, n);
}
