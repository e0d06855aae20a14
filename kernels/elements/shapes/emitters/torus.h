// Of a torus a place is chosen evenly by the angles around its ring and its tube. What its own tube hides is in its own shadow.
INLINE emitter_place torus_place(vec form, vec sides, vec point, real choice, real u, real v, const vec *met) {
    vec own;
    if (met) {
        own = vec_over(*met, sides);
    } else {
        const real around = R(2.0) * LIGHT_PI * u, turn = R(2.0) * LIGHT_PI * v, arm = form.x + form.y * cos(turn);
        own = vec_of(arm * cos(around), arm * sin(around), sin(turn));
    }
    // The area of a step of both angles, as a vector away from the inside: the product of the two ways along which places move.
    const vec off = torus_offset(form, torus_even(form, own));
    const real arm = sqrt(own.x * own.x + own.y * own.y), high = sides.z / form.y;
    const vec area = vec_scale(vec_of(off.x * sides.y * high, off.y * sides.x * high, off.z * sides.x * sides.y), arm);
    emitter_place found;
    found.way = vec_sub(vec_mul(own, sides), point);
    const real square = vec_dot(found.way, found.way), facing = -vec_dot(area, found.way);
    // (0.0253: one over the square of a whole turn.)
    const real density = R(0.025330295910584444) * square * sqrt(square) / fmax(facing, (real)(REAL_SMALLEST));
    found.density = pick(less(R(0.0), facing), density, R(0.0));
    return found;
}

INLINE real torus_weight(vec form, vec sides, vec point, real bright) {
    const vec own = vec_over(point, sides);
    const vec nearest = vec_mul(torus_on(form, own), sides);
    return weight_of_sides(sides, point, nearest, torus_holds(form, own), LIGHT_PI, bright);
}
