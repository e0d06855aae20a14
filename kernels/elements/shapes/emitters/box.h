// Of a box a place of the faces that are seen is chosen, by solid angle.

// The face of a box across one of its axes, on the point's side, and how likely it is chosen: 0 where it is not seen.
typedef struct {
    seen_rectangle seen;
    real area, share;
} box_face;

INLINE box_face box_face_of(vec point, vec sides) {
    const real height = fabs(point.z) - sides.z, over = fmax(height, (real)(REAL_SMALLEST)), area = R(4.0) * sides.x * sides.y;
    const seen_rectangle seen = rectangle_between(-point.x - sides.x, sides.x - point.x, -point.y - sides.y, sides.y - point.y, over);
    const real square = point.x * point.x + point.y * point.y + over * over;
    const real small = area * over / (square * sqrt(square));
    return (box_face){seen, area, pick(less(R(0.0), height), pick(less(seen.angle, LEAST_ANGLE), small, seen.angle), R(0.0))};
}

// Components in another order, so that the one across a face is the last, and back.
INLINE vec turn_over(mask first, mask second, vec a) {
    return vec_pick(first, vec_of(a.y, a.z, a.x), vec_pick(second, vec_of(a.z, a.x, a.y), a));
}
INLINE vec turn_back(mask first, mask second, vec a) {
    return vec_pick(first, vec_of(a.z, a.x, a.y), vec_pick(second, vec_of(a.y, a.z, a.x), a));
}

// A place of one of the faces, chosen by `choice`; or, where `met` is given, the density of that place.
INLINE emitter_place box_place(vec form, vec sides, vec point, real choice, real u, real v, const vec *met) {
    const real of_x = box_face_of(vec_of(point.y, point.z, point.x), vec_of(sides.y, sides.z, sides.x)).share;
    const real of_y = box_face_of(vec_of(point.z, point.x, point.y), vec_of(sides.z, sides.x, sides.y)).share;
    const real all = of_x + of_y + box_face_of(point, sides).share;
    mask first = less(choice * all, of_x), second = ~first & less(choice * all, of_x + of_y);
    if (met) {
        const real x = fabs(met->x) / sides.x, y = fabs(met->y) / sides.y, z = fabs(met->z) / sides.z;
        first = less_equal(y, x) & less_equal(z, x);
        second = ~first & less_equal(z, y);
    }
    const vec from = turn_over(first, second, point);
    const box_face f = box_face_of(from, turn_over(first, second, sides));
    vec place = rectangle_place(&f.seen, u, v);
    place.z = copysign(place.z, -from.z);
    const vec way = met ? vec_sub(*met, point) : turn_back(first, second, place);
    const vec toward = turn_over(first, second, vec_normalize(way));
    return (emitter_place){way, f.share / fmax(all, (real)(REAL_SMALLEST)) * rectangle_place_density(&f.seen, f.area, fabs(toward.z))};
}

INLINE real box_weight(vec form, vec sides, vec point, real bright) {
    const real x = point.x / sides.x, y = point.y / sides.y, z = point.z / sides.z;
    const mask inside = less_equal(fmax(fmax(fabs(x), fabs(y)), fabs(z)), R(1.0));
    const vec nearest = vec_of(clamp(point.x, -sides.x, sides.x), clamp(point.y, -sides.y, sides.y), clamp(point.z, -sides.z, sides.z));
    return weight_of_sides(sides, point, nearest, inside, R(4.0), bright);
}
