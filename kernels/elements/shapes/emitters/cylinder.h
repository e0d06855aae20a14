// Of a cylinder a place of a lid is chosen by area, or of the side by the angle along its axis.

// What a point sees of a cylinder: in its own units the middle of the side that is seen, and the sine of half of it; the angle that the
// side fills along the axis, at a distance from it.
typedef struct {
    real x, y, sine, distance, angle;
    real of_side, of_lid;   // how likely each is chosen: 0 where it is not seen
} seen_cylinder;

INLINE seen_cylinder cylinder_seen(vec sides, vec point) {
    const real sx = sides.x, sy = sides.y, sz = sides.z, width = R(0.5) * (sx + sy);
    const real x = point.x / sx, y = point.y / sy, square = x * x + y * y;
    const real share = R(1.0) / sqrt(fmax(square, R(1e-12)));
    // Close to the surface as if a little farther.
    const real off = fmax(square - R(1.0), R(1e-6));
    seen_cylinder s = {.x = x * share, .y = y * share, .sine = sqrt(off / (off + R(1.0))), .distance = sqrt(off) * width};
    const real low = -sz - point.z, high = sz - point.z, far_off = s.distance * s.distance;
    s.angle = real_atan2(R(2.0) * sz * s.distance, far_off + low * high);
    const real across = sqrt(point.x * point.x + point.y * point.y);
    const real along = high / sqrt(far_off + high * high) - low / sqrt(far_off + low * low);
    const real seen = R(2.0) * least(width / fmax(across, (real)(REAL_SMALLEST)), R(1.5)) * along;
    s.of_side = pick(less(R(1.0), square), fmax(seen, (real)(REAL_SMALLEST)), R(0.0));
    const real height = fmax(fabs(point.z) - sz, (real)(REAL_SMALLEST)), far = across * across + height * height;
    const real lid = least(LIGHT_PI * sx * sy * height / (far * sqrt(far)), R(2.0) * LIGHT_PI);
    s.of_lid = pick(less(sz, fabs(point.z)), fmax(lid, (real)(REAL_SMALLEST)), R(0.0));
    return s;
}

// As `box_place`: along the side's circle evenly as seen from far, along its axis by the angle.
INLINE emitter_place cylinder_place(vec form, vec sides, vec point, real choice, real u, real v, const vec *met) {
    const seen_cylinder s = cylinder_seen(sides, point);
    const real sx = sides.x, sy = sides.y, sz = sides.z, all = s.of_side + s.of_lid;
    mask lid = less(choice * all, s.of_lid);
    vec place;
    if (met) {
        place = *met;
        const real x = place.x / sx, y = place.y / sy, z = place.z / sz;
        lid = less(x * x + y * y, z * z);
    } else {
        const real beside = (R(2.0) * u - R(1.0)) * s.sine, along = sqrt(R(1.0) - beside * beside);
        // From the lower end on, by the tangent of a sum of angles: so far cylinders keep their digits.
        const real angle = v * s.angle, slope = sin(angle), low = sz + point.z;
        const real up = slope * (s.distance * s.distance + low * low) / fmax(s.distance * cos(angle) + low * slope, (real)(REAL_SMALLEST));
        real x, y;
        unit_disk(u, v, &x, &y);
        place.x = sx * pick(lid, x, s.x * along - s.y * beside);
        place.y = sy * pick(lid, y, s.y * along + s.x * beside);
        place.z = pick(lid, copysign(sz, point.z), fmin(up - sz, sz));
    }
    emitter_place found;
    found.way = vec_sub(place, point);
    const real square = vec_dot(found.way, found.way);
    const vec toward = vec_scale(found.way, R(1.0) / sqrt(fmax(square, (real)(REAL_SMALLEST))));
    const real x = place.x / sx, y = place.y / sy, rise = place.z - point.z;
    // By area: on the side an arc's length for a turn is that of the normal (sy x, sx y), which the cosine has below it.
    const real facing = fabs(sy * x * toward.x + sx * y * toward.y);
    const real turns = fmax(x * s.x + y * s.y, R(0.0)) / (R(2.0) * s.sine);
    const real rises = s.distance / (s.angle * (s.distance * s.distance + rise * rise));
    const real on_side = s.of_side * turns * rises * square / fmax(facing, R(1e-30));
    const real on_lid = s.of_lid * square / (LIGHT_PI * sx * sy * fmax(fabs(toward.z), R(1e-30)));
    found.density = pick(lid, on_lid, on_side) / fmax(all, (real)(REAL_SMALLEST));
    return found;
}

INLINE real cylinder_weight(vec form, vec sides, vec point, real bright) {
    const real x = point.x / sides.x, y = point.y / sides.y, z = point.z / sides.z;
    const real across = x * x + y * y, share = R(1.0) / sqrt(fmax(across, R(1.0)));
    const mask inside = less_equal(across, R(1.0)) & less_equal(fabs(z), R(1.0));
    const vec nearest = vec_of(point.x * share, point.y * share, clamp(point.z, -sides.z, sides.z));
    return weight_of_sides(sides, point, nearest, inside, LIGHT_PI, bright);
}
