// Cut planes in the picture of an object: quads coloured by escape counts, composited by depth; and those that cut,
// which take away what lies in front of them and show the formula's counts on the face.
//
// Each cuts the set, or objects beside it, or both.
typedef struct {
    plane_record planes;
    orbit_record orbits;
    constants k;
    __global const float *palettes;   // PALETTE_SIZE colours for each plane
    object_record objects;
    int count;
} plane_set;

// The face of a cut is a thing that is seen, with a number of its own: FACES for each plane, the first one once, and the number of
// the object that is cut there, 0 for the set.
#define FACE_OF_PLANE ((real)((scalar)FACES))
#define MOST_OBJECTS 64

INLINE real face_number(real plane, real object) { return (plane + R(1.0)) * FACE_OF_PLANE + object; }
INLINE mask is_face(real thing) { return less_equal(FACE_OF_PLANE, thing); }

// Of a face the plane, from 0; of all else -1.
INLINE real plane_of_face(real thing) { return pick(is_face(thing), floor(thing / FACE_OF_PLANE) - R(1.0), R(-1.0)); }

// The number of what is cut there; of other things their own.
INLINE real thing_cut(real thing) { return pick(is_face(thing), thing - floor(thing / FACE_OF_PLANE) * FACE_OF_PLANE, thing); }

// Cuts a part of a ray's line to what is behind a plane. `face`: the plane at which it begins, which may now be this one.
INLINE void plane_cut(plane_record plane, int i, vec origin, vec direction, real *near, real *far, real *face) {
    const vec normal = vec_splat(plane->normal);
    const real height = vec_dot(vec_sub(origin, vec_splat(plane->center)), normal);
    const real climb = vec_dot(direction, normal);
    const real t = -height / pick(equal(climb, R(0.0)), (real)(REAL_SMALLEST), climb);
    const mask down = less(climb, R(0.0));
    const mask enters = down & less(*near, t);
    *face = pick(enters, (real)((scalar)i), *face);
    *near = pick(enters, t, *near);
    *far = pick(~down, fmin(*far, t), *far);
}

// A place that a ray has met on a plane, without the rounding of the way there.
INLINE vec place_on_plane(plane_record plane, vec point) {
    const vec normal = vec_splat(plane->normal);
    return vec_along(point, -vec_dot(vec_sub(point, vec_splat(plane->center)), normal), normal);
}

// Cuts a ray to the part that the planes leave of the set; lanes without such a part are not in the result. `face`: the plane
// at which a lane now begins, or -1.
INLINE mask planes_cut(ray *r, real *face, plane_set set) {
    *face = R(-1.0);
    for (int i = 0; i < set.count; ++i) {
        if (set.planes[i].cut) plane_cut(set.planes + i, i, r->origin, r->direction, &r->near, &r->far, face);
    }
    return less(r->near, r->far);
}

// How far along a ray from within the part of the set that planes leave it is up to the first of them, and which one that is; the largest
// number where it meets none.
INLINE real way_to_cut(vec origin, vec direction, real *plane, plane_set set) {
    real nearest = (real)(REAL_LARGEST), near = R(0.0), face = R(-1.0);
    *plane = R(-1.0);
    for (int i = 0; i < set.count; ++i) {
        if (!set.planes[i].cut) continue;
        real far = nearest;
        plane_cut(set.planes + i, i, origin, direction, &near, &far, &face);
        *plane = pick(less(far, nearest), (real)((scalar)i), *plane);
        nearest = fmin(far, nearest);
    }
    return nearest;
}

// Whether a plane cuts the object with this index.
INLINE int plane_cuts(plane_record plane, int object) { return plane->objects[object / 32] >> (object % 32) & 1; }
