// What files of `elements/shapes/emitters` are written with.

// A place of an object that was chosen, or met, from a turned point: the turned way to it, and the density of the choice per steradian.
typedef struct {
    vec way;
    real density;
} emitter_place;

// By what of its area faces the point, as far as its nearest place is. `round`: of what is across the axis, for squares of sides of 1.
INLINE real weight_of_sides(vec sides, vec point, vec nearest, mask inside, real round, real bright) {
    const real sx = sides.x, sy = sides.y, sz = sides.z;
    const vec offset = vec_sub(point, nearest), toward = vec_normalize(offset);
    const real area = R(4.0) * sz * (sy * fabs(toward.x) + sx * fabs(toward.y)) + round * sx * sy * fabs(toward.z);
    return pick(inside, R(0.0), bright * area / fmax(vec_dot(offset, offset) + area / LIGHT_PI, (real)(REAL_SMALLEST)));
}
