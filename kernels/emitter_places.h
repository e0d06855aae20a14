// Places of objects that shine, chosen by paths that ask for them. Of a ball a direction is chosen in the cone that it fills in its own
// units, of a box a place of the faces that are seen by solid angle, of a cylinder one of a lid by area, or of the side by the angle along
// its axis. Nobody asks for an object from inside it.
//
// A shape that can shine has a function which chooses a place of it that a turned point outside of it sees, or gives the density of that
// which is `met`: emitter_place NAME_place(vec sides, vec point, real choice, real u, real v, const vec *met).
#define SHINING(DO) DO(SPHERE, ball) DO(BOX, box) DO(CYLINDER, cylinder)

// "Turned" are places from the middle of an object along its axes, in scene units.
#define EMITTER_SIDE(o, i) ((real)((o)->sides[i]))

INLINE vec emitter_turned(object_record o, vec a) { return vec_mul(object_own(o, a), vec_splat(o->sides)); }

// A turned direction as one of space.
INLINE vec emitter_in_space(object_record o, vec a) {
    const vec own = vec_mul(a, vec_splat(o->sides));
    return vec_of_axes(o, own);
}

// A place of an object that was chosen, or met, from a turned point: the turned way to it, and the density of the choice per steradian.
typedef struct {
    vec way;
    real density;
} emitter_place;

// A ball's own units are those of a sphere: each direction there is one here, with the density times how much wider the angle is there
// (for the matrix A and a direction w of length 1: det A / |A w|^3).
INLINE real ball_density(vec sides, real square, vec direction) {
    const real share = R(1.0) / square, spread = share / (R(1.0) + sqrt(fmax(R(1.0) - share, R(0.0))));
    const vec own = vec_over(direction, sides);
    const real stretch = sqrt(vec_dot(own, own));
    return R(0.15915494309189535) / (spread * (sides.x * stretch) * (sides.y * stretch) * (sides.z * stretch));
}

INLINE emitter_place ball_place(vec sides, vec point, real choice, real u, real v, const vec *met) {
    const vec from = vec_over(point, sides);
    const real square = fmax(vec_dot(from, from), R(1.0));
    vec way;
    if (met) {
        way = vec_sub(*met, point);
    } else {
        const real share = R(1.0) / square;
        const vec own = cone_direction(vec_normalize(vec_scale(from, R(-1.0))), share / (R(1.0) + sqrt(R(1.0) - share)), u, v);
        // By the nearest place to the middle, as `ball_span`; each direction of the cone meets the ball.
        const real middle = -vec_dot(from, own);
        const vec nearest = vec_along(from, middle, own);
        const real distance = middle - sqrt(fmax(R(1.0) - vec_dot(nearest, nearest), R(0.0)));
        way = vec_mul(vec_scale(own, distance), sides);
    }
    return (emitter_place){way, ball_density(sides, square, vec_normalize(way))};
}

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
INLINE emitter_place box_place(vec sides, vec point, real choice, real u, real v, const vec *met) {
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
INLINE emitter_place cylinder_place(vec sides, vec point, real choice, real u, real v, const vec *met) {
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

// A place of an object that a turned point outside of it sees, or the density of the one that is `met`.
#define PLACE_OF(KIND, name) case SHAPE_##KIND: return name##_place(vec_splat(o->sides), point, choice, u, v, met);
INLINE emitter_place emitter_place_of(object_record o, vec point, real choice, real u, real v, const vec *met) {
    switch (o->kind) { SHINING(PLACE_OF) default: return (emitter_place){point, R(0.0)}; }
}

// About the irradiance that an object can bring to a point; 0 inside it, and where nobody asks for it.
CALLED real emitter_weight(object_record o, const vec *at) {
    const vec point = emitter_turned(o, vec_sub(*at, vec_splat(o->middle)));
    const real sx = EMITTER_SIDE(o, 0), sy = EMITTER_SIDE(o, 1), sz = EMITTER_SIDE(o, 2);
    const real x = point.x / sx, y = point.y / sy, z = point.z / sz, bright = (real)(o->luminance);
    if (o->kind == SHAPE_SPHERE) {
        const real own = x * x + y * y + z * z, square = fmax(vec_dot(point, point), (real)(REAL_SMALLEST));
        const real share = least(sx * sy * sz * sqrt(own / square) / square, R(1.0));
        return pick(less(R(1.0), own), LIGHT_PI * bright * share, R(0.0));
    }
    // By what of its area faces the point, as far as its nearest place is.
    const real across = x * x + y * y, share = R(1.0) / sqrt(fmax(across, R(1.0)));
    const mask inside = o->kind == SHAPE_BOX ? less_equal(fmax(fmax(fabs(x), fabs(y)), fabs(z)), R(1.0))
                                              : less_equal(across, R(1.0)) & less_equal(fabs(z), R(1.0));
    const vec nearest = o->kind == SHAPE_BOX ? vec_of(clamp(point.x, -sx, sx), clamp(point.y, -sy, sy), clamp(point.z, -sz, sz))
                                              : vec_of(point.x * share, point.y * share, clamp(point.z, -sz, sz));
    const vec offset = vec_sub(point, nearest), toward = vec_normalize(offset);
    const real round = o->kind == SHAPE_BOX ? R(4.0) : LIGHT_PI;
    const real area = R(4.0) * sz * (sy * fabs(toward.x) + sx * fabs(toward.y)) + round * sx * sy * fabs(toward.z);
    return pick(inside, R(0.0), bright * area / fmax(vec_dot(offset, offset) + area / LIGHT_PI, (real)(REAL_SMALLEST)));
}

CALLED emitter_place emitter_chosen(object_record o, const vec *at, real choice, real u, real v) {
    return emitter_place_of(o, emitter_turned(o, vec_sub(*at, vec_splat(o->middle))), choice, u, v, 0);
}

// Where a ray from outside meets an object `distance` away: the density with which a place asks for it that has chosen it.
CALLED real emitter_density(object_record o, const vec *at, const vec *direction, real distance) {
    const vec point = emitter_turned(o, vec_sub(*at, vec_splat(o->middle)));
    const vec met = vec_along(point, distance, emitter_turned(o, *direction));
    return emitter_place_of(o, point, R(0.0), R(0.5), R(0.5), &met).density;
}
