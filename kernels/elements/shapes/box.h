// The cube between -1 and 1.
enum { box_turn = EQUATION };
INLINE span box_span(vec form, int number, vec from, vec way) {
    return span_of_both(span_of_both(span_of_slab(from.x, way.x), span_of_slab(from.y, way.y)), span_of_slab(from.z, way.z));
}

INLINE vec box_normal(vec form, vec own) {
    const real x = fabs(own.x), y = fabs(own.y), z = fabs(own.z);
    const mask by_x = less_equal(y, x) & less_equal(z, x), by_y = ~by_x & less_equal(z, y);
    return vec_of(pick(by_x, own.x, R(0.0)), pick(by_y, own.y, R(0.0)), pick(by_x | by_y, R(0.0), own.z));
}

INLINE vec box_bends(vec form, vec own, vec way) { return vec_of(R(0.0), R(0.0), R(0.0)); }

INLINE vec box_on(vec form, vec own) {
    const real x = fabs(own.x), y = fabs(own.y), z = fabs(own.z), largest = fmax(fmax(x, y), z);
    return vec_of(pick(less(x, largest), own.x, copysign(R(1.0), own.x)), pick(less(y, largest), own.y, copysign(R(1.0), own.y)),
                  pick(less(z, largest), own.z, copysign(R(1.0), own.z)));
}

INLINE mask box_holds(vec form, vec own) { return less(fabs(own.z), R(1.0)) & less(fabs(own.x), R(1.0)) & less(fabs(own.y), R(1.0)); }

// Outside towards the nearest place of the box, inside to its nearest side. (In its own units, so by its sides once more.)
INLINE real box_far(vec form, vec own, vec sides, vec *n) {
    const real x = (fabs(own.x) - R(1.0)) * sides.x, y = (fabs(own.y) - R(1.0)) * sides.y, z = (fabs(own.z) - R(1.0)) * sides.z;
    const real within = fmax(fmax(x, y), z);
    const mask out = less(R(0.0), within);
    const real least = pick(out, R(0.0), within);
    n->x = copysign(pick(less(x, least), R(0.0), pick(out, x, R(1.0))) * sides.x, own.x);
    n->y = copysign(pick(less(y, least), R(0.0), pick(out, y, R(1.0))) * sides.y, own.y);
    n->z = copysign(pick(less(z, least), R(0.0), pick(out, z, R(1.0))) * sides.z, own.z);
    return above_length(x, y, z) + fmin(within, R(0.0));
}
