// What is seen of cut planes in the picture of an object: the formula at places of them.

// Whether a place is inside an object that a plane cuts.
INLINE mask cut_objects_hold(int plane, vec point, plane_set set);

// Where the formula is evaluated for a point of the picture: elsewhere if a volume is zoomed.
INLINE vec plane_place(vec point, plane_record plane) {
    return vec_along(vec_splat(plane->zoom_origin), (real)(plane->zoom), point);
}

// What a plane shows at a point of it: the formula, and the inside of what it cuts beside the set.
INLINE escaped plane_look(vec point, mask active, int i, plane_set set) {
    escaped e = plane_escape(plane_place(point, set.planes + i), active, set.planes[i].smooth, 1, set.planes[i].iterations,
                             set.orbits, set.k);
    e.inside |= active & cut_objects_hold(i, point, set);
    e.count = pick(e.inside, (real)((scalar)set.planes[i].iterations), e.count);
    return e;
}

// Whether the rays that begin at a plane which cuts the set begin inside it: faces, with their colours and the body there.
INLINE mask planes_face(ray r, real face, mask active, plane_set set, color *tint, vec *normal, real *count, real *body) {
    mask found = active & ~active;
    active &= less(R(-0.5), face);
    if (!any_lane(active)) return found;
    const vec point = vec_along(r.origin, r.near, r.direction);
    const vec place = plane_place(point, set.planes);
    const mask inside = orbit_bodies(place, active, R(0.0), body, set.orbits, set.k).inside;
    for (int i = 0; i < set.count; ++i) {
        const mask here = inside & active & equal(face, (real)((scalar)i));
        if (!any_lane(here)) continue;
        const escaped e = plane_look(point, here, i, set);
        *tint = color_pick(here, escape_color(e, set.planes + i, set.palettes + 3 * PALETTE_SIZE * i), *tint);
        *normal = vec_pick(here, vec_splat(set.planes[i].normal), *normal);
        *count = pick(here, e.count, *count);
        found |= here;
    }
    return found;
}

// The nearest quad past the one at the distance `before` and place `after` in the list: of quads at one distance the list's
// first is in front. The largest number where there is none.
typedef struct {
    real before, after, distance, index, alpha, count;
    color tint;
    vec normal;
} plane_hit;

// How far along a ray of the picture a quad is met; the largest number where it is not.
INLINE real quad_distance(ray r, plane_record plane, mask active) {
    const vec normal = vec_splat(plane->normal);
    const real climb = vec_dot(r.direction, normal);
    const vec offset = vec_sub(vec_splat(plane->center), r.origin);
    const real t = vec_dot(offset, normal) / pick(equal(climb, R(0.0)), (real)(REAL_SMALLEST), climb);
    const vec there = vec_sub(vec_scale(r.direction, t), offset);
    const mask met = active & less(R(0.0), t) & less(fabs(vec_dot(there, vec_splat(plane->side))), (real)(plane->half_width)) &
                     less(fabs(vec_dot(there, vec_splat(plane->up))), (real)(plane->half_height)) &
                     less(R(0.0), (real)(fmax(plane->opacity, plane->inside_opacity)));
    return pick(met, t, (real)(REAL_LARGEST));
}

// Distances are found anew for each quad that is asked for: what would be kept of them has no bound, and the formula, which takes
// longer, is asked once for each quad that is met.
CALLED plane_hit planes_next(const ray *r, real before, real after, mask active, plane_set set) {
    plane_hit next = {before, after, (real)(REAL_LARGEST), R(-1.0), R(0.0), R(0.0), color_of(R(0.0), R(0.0), R(0.0)), vec_of(R(0.0), R(0.0), R(0.0))};
    for (int i = 0; i < set.count; ++i) {
        const real distance = quad_distance(*r, set.planes + i, active), index = (real)((scalar)i);
        const mask further = less(before, distance) | (equal(before, distance) & less(after, index));
        const mask nearer = further & less(distance, next.distance);
        next.distance = pick(nearer, distance, next.distance);
        next.index = pick(nearer, index, next.index);
    }
    for (int i = 0; i < set.count; ++i) {
        plane_record plane = set.planes + i;
        const mask here = equal(next.index, (real)((scalar)i));
        if (!any_lane(here)) continue;
        const escaped e = plane_look(vec_along(r->origin, next.distance, r->direction), here, i, set);
        next.alpha = pick(here, pick(e.inside, (real)(plane->inside_opacity), (real)(plane->opacity)), next.alpha);
        next.count = pick(here, e.count, next.count);
        next.tint = color_pick(here, escape_color(e, plane, set.palettes + 3 * PALETTE_SIZE * i), next.tint);
        next.normal = vec_pick(here, vec_splat(plane->normal), next.normal);
    }
    return next;
}

// The quads along a ray of the picture, in front of and behind distance `object` (the largest number where nothing was hit).
// `hidden`: the plane whose quad is behind it though it is at this very distance, or -1.
INLINE plane_layers planes_seen(ray r, real object, real hidden, mask active, plane_set set) {
    plane_layers layers = {.front_through = R(1.0), .behind_through = R(1.0), .nearest = (real)(REAL_LARGEST),
                           .normal = vec_scale(r.direction, R(-1.0))};
    real before = R(-1.0), after = R(-1.0);
    for (int pass = 0; pass < set.count; ++pass) {
        const plane_hit next = planes_next(&r, before, after, active, set);
        if (!any_lane(less(next.distance, (real)(REAL_LARGEST)))) break;
        before = next.distance;
        after = next.index;
        const mask in_front = less(next.distance, object) & ~equal(next.index, hidden);
        const real front = pick(in_front, next.alpha * layers.front_through, R(0.0));
        const real behind = pick(in_front, R(0.0), next.alpha * layers.behind_through);
        layers.front = color_add(layers.front, color_scale(next.tint, front));
        layers.behind = color_add(layers.behind, color_scale(next.tint, behind));
        layers.front_through -= front;
        layers.behind_through -= behind;
        const mask well = in_front & less_equal(R(0.5), next.alpha) & less(next.distance, layers.nearest);
        layers.nearest = pick(well, next.distance, layers.nearest);
        layers.normal = vec_pick(well, next.normal, layers.normal);
        layers.count = pick(well, next.count, layers.count);
    }
    const mask seen = less(layers.nearest, (real)(REAL_LARGEST));
    layers.point = vec_along(r.origin, pick(seen, layers.nearest, R(0.0)), r.direction);
    return layers;
}
