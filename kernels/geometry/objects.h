// Objects beside the set: shapes, waves, and values on grids.
#include "geometry/plane_cuts.h"
#include "geometry/object_grids.h"
#include "geometry/water.h"

INLINE int turn_to_meet(object_record o) {
    return o->kind == OBJECT_WATER ? WATER : o->kind == OBJECT_VOLUME ? GRID : shape_turn(o->kind);
}

// Where a ray meets the object with index `i`, if it is of this turn; planes may leave a part of it only. `face`: the plane whose cut it
// meets there, or -1.
INLINE real object_met(int i, int turn, vec origin, vec direction, object_record objects, plane_set planes, real *face) {
    real nearest = (real)(REAL_LARGEST);
    *face = R(-1.0);
    const int spans = turn == EQUATION ? 1 : objects[i].spans;
    for (int number = 0; number < spans; ++number) {
        span s = object_span(objects + i, turn, number, origin, direction);
        real begins = R(-1.0), ends = R(-1.0);
        for (int plane = 0; plane < planes.count; ++plane) {
            if (!plane_cuts(planes.planes + plane, i)) continue;
            const real exit = s.exit;
            plane_cut(planes.planes + plane, plane, origin, direction, &s.entry, &s.exit, &begins);
            ends = pick(less(s.exit, exit), (real)((scalar)plane), ends);
        }
        const real first = span_first(s);
        *face = pick(less(first, nearest), pick(less(R(0.0), s.entry), begins, ends), *face);
        nearest = fmin(first, nearest);
    }
    return nearest;
}

// Takes what a ray meets of an object, if that is the nearest so far.
INLINE void nearer_met(real t, int i, const ray *r, real *nearest, real *number) {
    const mask here = less(t, *nearest) & less(t, r->far);
    *nearest = pick(here, t, *nearest);
    *number = pick(here, (real)((scalar)(i + 1)), *number);
}

// The nearest object that a ray meets before its `far`: how far it is, or the largest number; and its number from 1, or 0. (One loop a
// turn: in one loop for all they would hold each other's registers.)
CALLED real objects_met(const ray *r, object_record objects, plane_set planes, int count, __global const float *tables, real *number) {
    real nearest = (real)(REAL_LARGEST), face;
    *number = R(0.0);
    for (int i = 0; i < count; ++i) {
        if (turn_to_meet(objects + i) != EQUATION) continue;
        nearer_met(object_met(i, EQUATION, r->origin, r->direction, objects, planes, &face), i, r, &nearest, number);
    }
    for (int i = 0; i < count; ++i) {
        if (turn_to_meet(objects + i) != SEARCH) continue;
        nearer_met(object_met(i, SEARCH, r->origin, r->direction, objects, planes, &face), i, r, &nearest, number);
    }
    for (int i = 0; i < count; ++i) {
        if (turn_to_meet(objects + i) != WATER) continue;
        const vec from = object_own(objects + i, vec_sub(r->origin, vec_splat(objects[i].middle)));
        const vec way = object_own(objects + i, r->direction);
        nearer_met(water_met(objects + i, from, way, fmin(nearest, r->far), r->footprint, r->spread), i, r, &nearest, number);
    }
    for (int i = 0; i < count; ++i) {
        if (turn_to_meet(objects + i) != GRID) continue;
        nearer_met(level_met(objects + i, tables, r->origin, r->direction, fmin(nearest, r->far)), i, r, &nearest, number);
    }
    return nearest;
}

// The normal at a place of an object's surface, length 1, away from its inside.
INLINE vec object_normal(object_record o, vec point, __global const float *tables) {
    const vec own = object_own(o, vec_sub(point, vec_splat(o->middle)));
    vec n = shape_normal(o->kind, vec_splat(o->form), own);
    if (o->kind == OBJECT_WATER) n = water_normal(o, own.x, own.y);
    if (o->kind == OBJECT_VOLUME) {
        // What places are rounded to, in units of the box.
        const real far_out = fmax(fmax(fabs(point.x), fabs(point.y)), fabs(point.z));
        const scalar thinnest = fmin(fmin(o->sides[0], o->sides[1]), o->sides[2]);
        n = level_normal(o, tables, own, R(16.0) * (real)(REAL_EPSILON) * (R(1.0) + far_out / (real)(thinnest)));
    }
    // A normal goes from its own units to scene units by the transposed matrix.
    return vec_normalize(vec_of_axes(o, n));
}

// A place that a ray has met of an object's surface, without the rounding of the way there: as near to the surface as numbers can be.
// (Of grids it stays as it was found.)
INLINE vec object_place(object_record o, vec point) {
    const vec own = object_own(o, vec_sub(point, vec_splat(o->middle)));
    vec on = shape_on(o->kind, vec_splat(o->form), own);
    real unused;
    if (o->kind == OBJECT_WATER) on.z = water_height(o, own.x, own.y, own, &unused);
    // Each of its axes is as long as a side, and its own number is the product with the axis by the side's square.
    const vec off = vec_sub(on, own);
    point = vec_along(point, off.x * (real)(o->sides[0] * o->sides[0]), vec_splat(o->own_x));
    point = vec_along(point, off.y * (real)(o->sides[1] * o->sides[1]), vec_splat(o->own_y));
    return vec_along(point, off.z * (real)(o->sides[2] * o->sides[2]), vec_splat(o->own_z));
}

// Whether a place is inside an object, or below a plane.
INLINE mask object_holds(object_record o, vec point) {
    const vec own = object_own(o, vec_sub(point, vec_splat(o->middle)));
    real unused;
    if (o->kind == OBJECT_WATER) return less(own.z, water_height(o, own.x, own.y, own, &unused));
    return shape_holds(o->kind, vec_splat(o->form), own);
}

// Whether a place is inside the object with this index, and no plane has removed it there.
INLINE mask object_left(int i, vec place, object_record objects, plane_set planes) {
    mask left = object_holds(objects + i, place);
    for (int plane = 0; plane < planes.count; ++plane) {
        if (!plane_cuts(planes.planes + plane, i)) continue;
        const vec from = vec_sub(place, vec_splat(planes.planes[plane].center));
        left &= less(vec_dot(from, vec_splat(planes.planes[plane].normal)), R(0.0));
    }
    return left;
}

// The normal at a place of a thing that is an object's own surface or the face of a cut of it, away from the inside.
INLINE vec thing_normal(real thing, object_record o, vec place, plane_set planes, __global const float *tables) {
    vec normal = object_normal(o, place, tables);
    const real plane = plane_of_face(thing);
    for (int i = 0; i < planes.count; ++i) {
        normal = vec_pick(equal(plane, (real)((scalar)i)), vec_splat(planes.planes[i].normal), normal);
    }
    return normal;
}

// What a ray has met of the objects with these numbers: where that is the face of a cut its number, normal and place.
INLINE real objects_faced(vec origin, vec direction, real number, object_record objects, plane_set planes, int count,
                          vec *normal, vec point, vec *place) {
    real thing = number;
    if (planes.count == 0) return thing;   // (nothing is met once more)
    for (int i = 0; i < count; ++i) {
        const mask here = equal(number, (real)((scalar)(i + 1)));
        if (!any_lane(here)) continue;
        real face;
        object_met(i, ANY_TURN, origin, direction, objects, planes, &face);
        for (int plane = 0; plane < planes.count; ++plane) {
            const mask faced = here & equal(face, (real)((scalar)plane));
            const vec front = vec_splat(planes.planes[plane].normal);
            const real side = pick(less(R(0.0), vec_dot(front, direction)), R(-1.0), R(1.0));
            thing = pick(faced, face_number(face, number), thing);
            *normal = vec_pick(faced, vec_scale(front, side), *normal);
            *place = vec_pick(faced, place_on_plane(planes.planes + plane, point), *place);
        }
    }
    return thing;
}

// The places of the objects with these numbers, as above.
CALLED vec objects_place(const vec *point, real number, object_record objects, int count) {
    vec place = *point;
    for (int i = 0; i < count; ++i) {
        const mask here = equal(number, (real)((scalar)(i + 1)));
        if (any_lane(here)) place = vec_pick(here, object_place(objects + i, *point), place);
    }
    return place;
}

// The normals of the objects at places of theirs, towards the viewer.
CALLED vec objects_normal(const vec *point, const vec *direction, real number, object_record objects, int count,
                          __global const float *tables) {
    vec normal = vec_scale(*direction, R(-1.0));
    for (int i = 0; i < count; ++i) {
        const mask here = equal(number, (real)((scalar)(i + 1)));
        if (!any_lane(here)) continue;
        normal = vec_pick(here, object_normal(objects + i, *point, tables), normal);
    }
    // Where values of a grid are the same around a place there is none.
    normal = vec_pick(less(vec_dot(normal, normal), R(0.5)), vec_scale(*direction, R(-1.0)), normal);
    const mask away = less(R(0.0), vec_dot(normal, *direction));
    return vec_pick(away, vec_scale(normal, R(-1.0)), normal);
}
