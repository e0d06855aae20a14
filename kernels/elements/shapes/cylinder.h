// The cylinder of radius 1 between z = -1 and 1. With unequal sides its distances are too small, but not their directions.
enum { cylinder_turn = EQUATION };
INLINE span cylinder_span(vec form, int number, vec from, vec way) {
    // A way along the axis is in the tube everywhere, or nowhere.
    const real across = way.x * way.x + way.y * way.y, distance = from.x * from.x + from.y * from.y;
    const mask level = less(across, R(1e-14) * (across + way.z * way.z)), in = less(distance, R(1.0));
    const span disc = span_of_ball(vec_of(from.x, from.y, R(0.0)), vec_of(way.x, way.y, R(0.0)));
    const real all = (real)(REAL_LARGEST);
    const span tube = {pick(level, pick(in, -all, R(1.0)), disc.entry), pick(level, pick(in, all, R(-1.0)), disc.exit)};
    return span_of_both(tube, span_of_slab(from.z, way.z));
}

INLINE vec cylinder_normal(vec form, vec own) {
    const mask lid = less(own.x * own.x + own.y * own.y, own.z * own.z);
    return vec_of(pick(lid, R(0.0), own.x), pick(lid, R(0.0), own.y), pick(lid, own.z, R(0.0)));
}

INLINE vec cylinder_bends(vec form, vec own, vec way) {
    const mask lid = less(own.x * own.x + own.y * own.y, own.z * own.z);
    return vec_of(pick(lid, R(0.0), way.x), pick(lid, R(0.0), way.y), R(0.0));
}

INLINE vec cylinder_on(vec form, vec own) {
    const real square = own.x * own.x + own.y * own.y;
    const mask lid = less(square, own.z * own.z);
    const real thinner = pick(lid, R(1.0), R(1.0) / fmax(sqrt(square), R(1e-30)));
    return vec_of(own.x * thinner, own.y * thinner, pick(lid, copysign(R(1.0), own.z), own.z));
}

INLINE mask cylinder_holds(vec form, vec own) {
    const real across = own.x * own.x + own.y * own.y;
    return less(fabs(own.z), R(1.0)) & less(across, R(1.0));
}

INLINE real cylinder_far(vec form, vec own, vec sides, vec *n) {
    const real arm = sqrt(own.x * own.x + own.y * own.y), thin = fmin(sides.x, sides.y);
    const real side = (arm - R(1.0)) * thin, lid = (fabs(own.z) - R(1.0)) * sides.z, within = fmax(side, lid);
    const mask out = less(R(0.0), within);
    const real across = pick(out, fmax(side, R(0.0)), pick(less(lid, side), R(1.0), R(0.0))) * thin / fmax(arm, R(1e-30));
    const real along = pick(out, fmax(lid, R(0.0)), pick(less(lid, side), R(0.0), R(1.0))) * sides.z;
    *n = vec_of(across * own.x, across * own.y, copysign(along, own.z));
    return above_length(side, lid, R(0.0)) + fmin(within, R(0.0));
}
