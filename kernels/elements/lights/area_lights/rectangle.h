// Of a rectangle a place is chosen by solid angle (`rectangles.h`).

// What a point sees of it, and the directions of x, y and z.
typedef struct {
    vec side, upward, toward;
    seen_rectangle seen;
} light_rectangle;

INLINE light_rectangle rectangle_light_seen(light_record light, vec point) {
    light_rectangle r;
    const vec side = vec_splat(light->side), upward = vec_splat(light->upward), offset = vec_sub(vec_splat(light->vector), point);
    const real wide = sqrt(vec_dot(side, side)), high = sqrt(vec_dot(upward, upward));
    r.side = vec_scale(side, R(1.0) / wide);
    r.upward = vec_scale(upward, R(1.0) / high);
    r.toward = vec_scale(vec_splat(light->axis), R(-1.0));
    const real left = vec_dot(offset, r.side) - wide, lower = vec_dot(offset, r.upward) - high;
    const real height = most(vec_dot(offset, r.toward), (real)(REAL_SMALLEST));
    r.seen = rectangle_between(left, left + R(2.0) * wide, lower, lower + R(2.0) * high, height);
    return r;
}

INLINE vec rectangle_light_direction(light_record light, vec point, vec middle, real u, real v) {
    const light_rectangle r = rectangle_light_seen(light, point);
    const vec place = rectangle_place(&r.seen, u, v);
    return vec_normalize(vec_along(vec_along(vec_scale(r.toward, place.z), place.x, r.side), place.y, r.upward));
}

INLINE real rectangle_light_density(light_record light, vec point, vec direction) {
    const light_rectangle r = rectangle_light_seen(light, point);
    return rectangle_place_density(&r.seen, (real)(light->area), vec_dot(direction, r.toward));
}

// How far its plane is.
INLINE real rectangle_light_distance(light_record light, vec point, vec direction, real middle) {
    const vec axis = vec_splat(light->axis);
    return vec_dot(vec_sub(vec_splat(light->vector), point), axis) / vec_dot(direction, axis);
}

INLINE mask rectangle_light_met(light_record light, vec origin, vec direction, real *distance) {
    const vec offset = vec_sub(vec_splat(light->vector), origin);
    *distance = rectangle_light_distance(light, origin, direction, R(0.0));
    const vec place = vec_sub(vec_scale(direction, *distance), offset), side = vec_splat(light->side), upward = vec_splat(light->upward);
    const mask front = less(vec_dot(direction, vec_splat(light->axis)), R(0.0)) & less(R(0.0), *distance);
    return front & less_equal(fabs(vec_dot(place, side)), vec_dot(side, side)) &
           less_equal(fabs(vec_dot(place, upward)), vec_dot(upward, upward));
}

INLINE vec rectangle_light_normal(light_record light, vec place) { return vec_splat(light->axis); }
