// Of a cone a place of a lid is chosen by area, or of the part of its side that is seen: evenly around, and by area along.

// What a point sees of a cone, in its own units around the axis: towards where, and half the angle of the side's part that is seen.
typedef struct {
    real x, y, width;
    real of_side, of_lid;   // how likely each is chosen: 0 where it is not seen
} seen_cone;

INLINE seen_cone cone_seen(vec form, vec sides, vec point) {
    const vec own = vec_over(point, sides);
    const real arm = sqrt(own.x * own.x + own.y * own.y), share = R(1.0) / fmax(arm, R(1e-12)), width = R(0.5) * (sides.x + sides.y);
    // The plane at a line of the side goes past the point by the cosine that the line has to the point's direction.
    const real cosine = clamp(cone_radius(form, own.z) * share, R(-1.0), R(1.0));
    seen_cone s = {.x = pick(less(arm, R(1e-12)), R(1.0), own.x * share), .y = own.y * share};
    s.width = real_atan2(sqrt((R(1.0) - cosine) * (R(1.0) + cosine)), cosine);
    const real out = (form.y - form.x) * width, slant = sqrt(out * out + R(4.0) * sides.z * sides.z), sum = form.x + form.y;
    // As the middle of that part is seen.
    const real off = arm * width - R(0.5) * sum * width, height = point.z, far = off * off + height * height;
    const real facing = (R(2.0) * sides.z * off - out * height) / (slant * sqrt(fmax(far, (real)(REAL_SMALLEST))));
    const real seen = s.width * sum * width * slant * clamp(facing, R(0.1), R(1.0)) / fmax(far, (real)(REAL_SMALLEST));
    s.of_side = pick(less(cosine, R(1.0)), fmax(least(seen, R(2.0) * LIGHT_PI), (real)(REAL_SMALLEST)), R(0.0));
    const real rise = fmax(fabs(point.z) - sides.z, (real)(REAL_SMALLEST)), radius = pick(less(point.z, R(0.0)), form.x, form.y);
    const real square = arm * arm * width * width + rise * rise, area = LIGHT_PI * sides.x * sides.y * radius * radius;
    const real lid = least(area * rise / (square * sqrt(square)), R(2.0) * LIGHT_PI);
    s.of_lid = pick(less(sides.z, fabs(point.z)) & less(R(0.0), radius), fmax(lid, (real)(REAL_SMALLEST)), R(0.0));
    return s;
}

INLINE emitter_place cone_place(vec form, vec sides, vec point, real choice, real u, real v, const vec *met) {
    const seen_cone s = cone_seen(form, sides, point);
    const real sum = form.x + form.y, all = s.of_side + s.of_lid, end = pick(less(point.z, R(0.0)), form.x, form.y);
    mask lid = less(choice * all, s.of_lid);
    vec own;
    if (met) {
        own = vec_over(*met, sides);
        lid = cone_lid(form, own, sqrt(own.x * own.x + own.y * own.y));
    } else {
        const real around = (R(2.0) * u - R(1.0)) * s.width, turn_x = cos(around), turn_y = sin(around);
        const real radius = sqrt(form.x * form.x + v * (form.y * form.y - form.x * form.x));
        real x, y;
        unit_disk(u, v, &x, &y);
        own.x = pick(lid, x * end, (s.x * turn_x - s.y * turn_y) * radius);
        own.y = pick(lid, y * end, (s.y * turn_x + s.x * turn_y) * radius);
        // (The share of the height, without a difference of radii that may be the same.)
        own.z = pick(lid, copysign(R(1.0), point.z), R(2.0) * v * sum / (radius + form.x) - R(1.0));
    }
    emitter_place found;
    found.way = vec_sub(vec_mul(own, sides), point);
    const real square = vec_dot(found.way, found.way), far = sqrt(square), arm = sqrt(own.x * own.x + own.y * own.y);
    // The area of a step around and along, over the radius: a vector away from the inside.
    const real share = R(2.0) * sides.z / fmax(arm, R(1e-30));
    const vec area = vec_of(sides.y * share * own.x, sides.x * share * own.y, sides.x * sides.y * (form.x - form.y));
    const real disc = LIGHT_PI * sides.x * sides.y * end * end;
    const real facing = -pick(lid, copysign(disc, own.z) * found.way.z, s.width * sum * vec_dot(area, found.way));
    const real density = pick(lid, s.of_lid, s.of_side) * square * far / fmax(facing * all, (real)(REAL_SMALLEST));
    found.density = pick(less(R(0.0), facing), density, R(0.0));
    return found;
}

INLINE real cone_weight(vec form, vec sides, vec point, real bright) {
    const vec own = vec_over(point, sides);
    const real z = clamp(own.z, R(-1.0), R(1.0)), arm = sqrt(own.x * own.x + own.y * own.y), radius = cone_radius(form, z);
    const real share = fmin(radius / fmax(arm, R(1e-30)), R(1.0));
    const vec nearest = vec_mul(vec_of(own.x * share, own.y * share, z), sides);
    return weight_of_sides(sides, point, nearest, cone_holds(form, own), LIGHT_PI, bright);
}
