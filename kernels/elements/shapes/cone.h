// The cone between z = -1 and 1 with the radii form.x and form.y there, of which the larger one is 1. With unequal sides its distances are
// too small, but not their directions.
enum { cone_turn = EQUATION };

// Its radius at a height, and beyond its ends where its side goes on; below 0 beyond the tip.
INLINE real cone_radius(vec form, real z) { return R(0.5) * ((R(1.0) - z) * form.x + (R(1.0) + z) * form.y); }

// Along a ray, x^2 + y^2 less the square of that radius is a t^2 + 2 b t + c, from its nearest place to the middle on.
INLINE span cone_span(vec form, int number, vec from, vec way) {
    const real share = R(1.0) / fmax(sqrt(vec_dot(way, way)), R(1e-30)), opens = R(0.5) * (form.y - form.x);
    const vec along = vec_scale(way, share);
    const real middle = -vec_dot(from, along);
    const vec nearest = vec_along(from, middle, along);
    const real radius = cone_radius(form, nearest.z), wider = opens * along.z;
    // A way along the side is within everywhere on one side of a place.
    const real square = along.x * along.x + along.y * along.y - wider * wider, a = pick(less(fabs(square), R(1e-14)), R(1e-14), square);
    const real b = nearest.x * along.x + nearest.y * along.y - radius * wider;
    const real c = nearest.x * nearest.x + nearest.y * nearest.y - radius * radius;
    const real under = b * b - a * c, sum = -(b + copysign(sqrt(fmax(under, R(0.0))), b)), one = sum / a, other = c / divisor(sum);
    const real first = fmin(one, other), last = fmax(one, other), all = (real)(REAL_LARGEST);
    // Steeper than the side it is within before the first place, or after the last one: where the cone goes, not its mirror image.
    const mask steep = less(a, R(0.0)), later = less(R(0.0), wider), none = ~steep & less(under, R(0.0));
    const span side = {pick(steep, pick(later, last, -all), first), pick(steep, pick(later, all, first), last)};
    const span inside = span_of_both(side, span_of_slab(nearest.z, along.z));
    return (span){pick(none, R(1.0), (middle + inside.entry) * share), pick(none, R(-1.0), (middle + inside.exit) * share)};
}

// Whether a place of the surface is on a lid.
INLINE mask cone_lid(vec form, vec own, real arm) { return less(arm - cone_radius(form, own.z), fabs(own.z) - R(1.0)); }

INLINE vec cone_normal(vec form, vec own) {
    const real arm = sqrt(own.x * own.x + own.y * own.y);
    const mask lid = cone_lid(form, own, arm);
    return vec_of(pick(lid, R(0.0), own.x), pick(lid, R(0.0), own.y), pick(lid, own.z, R(0.5) * (form.x - form.y) * arm));
}

INLINE vec cone_bends(vec form, vec own, vec way) {
    const real arm = sqrt(own.x * own.x + own.y * own.y), out = (own.x * way.x + own.y * way.y) / fmax(arm, R(1e-30));
    const mask lid = cone_lid(form, own, arm);
    return vec_of(pick(lid, R(0.0), way.x), pick(lid, R(0.0), way.y), pick(lid, R(0.0), R(0.5) * (form.x - form.y) * out));
}

INLINE vec cone_on(vec form, vec own) {
    const real arm = sqrt(own.x * own.x + own.y * own.y);
    const mask lid = cone_lid(form, own, arm);
    const real thinner = pick(lid, R(1.0), fmax(cone_radius(form, own.z), R(0.0)) / fmax(arm, R(1e-30)));
    return vec_of(own.x * thinner, own.y * thinner, pick(lid, copysign(R(1.0), own.z), own.z));
}

INLINE mask cone_holds(vec form, vec own) {
    return less(fabs(own.z), R(1.0)) & less(sqrt(own.x * own.x + own.y * own.y), cone_radius(form, own.z));
}

// By its section on one side of the axis, which is convex: the nearer one of its side and of the lid on the place's own half.
INLINE real cone_far(vec form, vec own, vec sides, vec *n) {
    const real thin = fmin(sides.x, sides.y), arm = sqrt(own.x * own.x + own.y * own.y);
    const real out = (form.y - form.x) * thin, up = R(2.0) * sides.z, slant = sqrt(out * out + up * up), nx = up / slant, nz = -out / slant;
    // From the rim of the lower lid.
    const real x = (arm - form.x) * thin, z = (own.z + R(1.0)) * sides.z, beside = x * nx + z * nz;
    const real place = clamp((x * out + z * up) / (slant * slant), R(0.0), R(1.0));
    const mask on_side = less(R(0.0), place) & less(place, R(1.0));
    const real side_x = pick(on_side, beside * nx, x - place * out), side_z = pick(on_side, beside * nz, z - place * up);
    const real lid_z = (fabs(own.z) - R(1.0)) * sides.z;
    const real lid_x = fmax((arm - pick(less(own.z, R(0.0)), form.x, form.y)) * thin, R(0.0));
    const real to_side = side_x * side_x + side_z * side_z, to_lid = lid_x * lid_x + lid_z * lid_z, within = fmax(beside, lid_z);
    const mask outside = less(R(0.0), within), lid = (outside & less(to_lid, to_side)) | (~outside & less(beside, lid_z));
    const real across = pick(lid, pick(outside, lid_x, R(0.0)), pick(outside, side_x, nx)) * thin / fmax(arm, R(1e-30));
    const real along = pick(lid, copysign(pick(outside, lid_z, R(1.0)), own.z), pick(outside, side_z, nz));
    *n = vec_of(across * own.x, across * own.y, along * sides.z);
    return pick(outside, sqrt(fmin(to_side, to_lid)), within);
}
