// Cut planes that stand in the picture of an object: quads coloured by escape counts, composited by depth; and those that cut,
// which take away what lies in front of them and show the formula's counts on the face.
//
// PLANES of them; `orbits` has the scene's own limits, then those of each plane.
typedef struct {
    __constant const struct CutPlane *planes;
    __constant const struct Orbit *orbits;
    __constant const scalar *k;
    __global const float *palettes;   // PALETTE_SIZE colours for each plane
} plane_set;

// What the planes add to a picture. In front of the object: light, and the part that comes through; behind it the same.
typedef struct {
    color front, behind;
    real front_through, behind_through;
    real nearest;      // the nearest plane that is seen well, along the ray; the largest number if there is none
    vec normal, point;
    real count;
} plane_layers;

// Cuts a ray to what the cutting planes leave; lanes with nothing left are not in the result. `face`: the plane at which a lane
// now begins, or -1.
INLINE mask planes_cut(ray *r, real *face, plane_set set) {
    *face = R(-1.0);
    for (int i = 0; i < PLANES; ++i) {
        if (!set.planes[i].cut) continue;
        const vec normal = vec_splat(set.planes[i].normal);
        const real height = vec_dot(vec_sub(r->origin, vec_splat(set.planes[i].center)), normal);
        const real climb = vec_dot(r->direction, normal);
        const real t = -height / pick(equal(climb, R(0.0)), (real)(REAL_SMALLEST), climb);
        const mask down = less(climb, R(0.0));
        const mask enters = down & less(r->near, t);
        *face = pick(enters, (real)((scalar)i), *face);
        r->near = pick(enters, t, r->near);
        r->far = pick(~down, fmin(r->far, t), r->far);
    }
    return less(r->near, r->far);
}

// Where the formula is evaluated for a point of the picture: elsewhere if a volume is zoomed.
INLINE vec plane_place(vec point, __constant const struct CutPlane *plane) {
    return vec_along(vec_splat(plane->zoom_origin), (real)(plane->zoom), point);
}

INLINE escaped plane_look(vec point, mask active, int i, plane_set set) {
    return plane_escape(plane_place(point, set.planes + i), active, set.planes[i].smooth, 1, set.orbits + 1 + i, set.k);
}

// Whether the rays that begin at a cutting plane begin inside the set: faces, with their colours.
INLINE mask planes_face(ray r, real face, mask active, plane_set set, color *tint, vec *normal, real *count) {
    mask found = active & ~active;
    active &= less(R(-0.5), face);
    if (!any_lane(active)) return found;
    const vec point = vec_along(r.origin, r.near, r.direction);
    const mask inside = orbit_inside(plane_place(point, set.planes), active, set.orbits->iterations, set.orbits, set.k);
    for (int i = 0; i < PLANES; ++i) {
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

// The quads along a ray of the picture, in front of and behind distance `object` (the largest number where nothing was hit).
INLINE plane_layers planes_seen(ray r, real object, mask active, plane_set set) {
    real distance[PLANES], alpha[PLANES], counts[PLANES];
    color tints[PLANES];
    for (int i = 0; i < PLANES; ++i) {
        __constant const struct CutPlane *plane = set.planes + i;
        const vec normal = vec_splat(plane->normal);
        const real climb = vec_dot(r.direction, normal);
        const vec offset = vec_sub(vec_splat(plane->center), r.origin);
        const real t = vec_dot(offset, normal) / pick(equal(climb, R(0.0)), (real)(REAL_SMALLEST), climb);
        const vec there = vec_sub(vec_scale(r.direction, t), offset);
        const mask met = active & less(R(0.0), t) &
                         less(fabs(vec_dot(there, vec_splat(plane->side))), (real)(plane->half_width)) &
                         less(fabs(vec_dot(there, vec_splat(plane->up))), (real)(plane->half_height)) &
                         less(R(0.0), (real)(plane->opacity));
        distance[i] = pick(met, t, (real)(REAL_LARGEST));
        alpha[i] = R(0.0);
        counts[i] = R(0.0);
        tints[i] = color_of(R(0.0), R(0.0), R(0.0));
        if (!any_lane(met)) continue;
        const escaped e = plane_look(vec_along(r.origin, t, r.direction), met, i, set);
        tints[i] = escape_color(e, plane, set.palettes + 3 * PALETTE_SIZE * i);
        alpha[i] = pick(met, (real)(plane->opacity), R(0.0));
        counts[i] = e.count;
    }
    plane_layers layers;
    layers.front = color_of(R(0.0), R(0.0), R(0.0));
    layers.behind = layers.front;
    layers.front_through = R(1.0);
    layers.behind_through = R(1.0);
    layers.nearest = (real)(REAL_LARGEST);
    layers.normal = vec_scale(r.direction, R(-1.0));
    layers.count = R(0.0);
    real before = R(-1.0);
    for (int pass = 0; pass < PLANES; ++pass) {
        // The nearest of those that are left.
        real t = (real)(REAL_LARGEST), a = R(0.0), count = R(0.0);
        color tint = color_of(R(0.0), R(0.0), R(0.0));
        vec normal = layers.normal;
        for (int i = 0; i < PLANES; ++i) {
            const mask nearer = less(before, distance[i]) & less(distance[i], t);
            t = pick(nearer, distance[i], t);
            a = pick(nearer, alpha[i], a);
            count = pick(nearer, counts[i], count);
            tint = color_pick(nearer, tints[i], tint);
            normal = vec_pick(nearer, vec_splat(set.planes[i].normal), normal);
        }
        if (!any_lane(less(t, (real)(REAL_LARGEST)))) break;
        before = t;
        const mask in_front = less(t, object);
        const real front = pick(in_front, a * layers.front_through, R(0.0));
        const real behind = pick(in_front, R(0.0), a * layers.behind_through);
        layers.front = color_add(layers.front, color_scale(tint, front));
        layers.behind = color_add(layers.behind, color_scale(tint, behind));
        layers.front_through -= front;
        layers.behind_through -= behind;
        const mask well = in_front & less_equal(R(0.5), a) & less(t, layers.nearest);
        layers.nearest = pick(well, t, layers.nearest);
        layers.normal = vec_pick(well, normal, layers.normal);
        layers.count = pick(well, count, layers.count);
    }
    const mask seen = less(layers.nearest, (real)(REAL_LARGEST));
    layers.point = vec_along(r.origin, pick(seen, layers.nearest, R(0.0)), r.direction);
    return layers;
}

// Puts the planes into a shot whose radiance is still that of the object alone, not over any background.
INLINE shot planes_into(shot s, color object, color background, plane_layers layers, __constant const struct View *view) {
    const color far = color_add(layers.behind, color_scale(background, layers.behind_through));
    const color middle = color_mix(far, object, s.coverage);
    s.radiance = color_add(layers.front, color_scale(middle, layers.front_through));
    s.coverage = R(1.0) - layers.front_through * (R(1.0) - s.coverage) * layers.behind_through;
    const mask seen = less(layers.nearest, (real)(REAL_LARGEST));
    s.hit |= seen;
    s.point = vec_pick(seen, layers.point, s.point);
    s.normal = vec_pick(seen, layers.normal, s.normal);
    s.smooth = pick(seen, layers.count, s.smooth);
    s.depth = pick(seen, vec_dot(vec_sub(layers.point, vec_splat(view->eye)), vec_splat(view->axis)), s.depth);
    return s;
}
