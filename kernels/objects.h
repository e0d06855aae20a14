// Objects beside the set, met by their equations. A solid is the ball, cube or cylinder of radius 1 in units of its own, into which rays
// are brought; distances along a ray stay the same there.
#include "plane_cuts.h"

// A direction's component as a divisor.
INLINE real divisor(real a) { return pick(less(fabs(a), R(1e-30)), R(1e-30), a); }
#include "water.h"

// The part of a ray's line in a solid: a plane's is all below it. `exit` is below `entry` where there is none.
typedef struct {
    real entry, exit;
} span;

INLINE vec object_own(__global const struct Object *o, vec a) {
    return vec_of(vec_dot(a, vec_splat(o->own_x)), vec_dot(a, vec_splat(o->own_y)), vec_dot(a, vec_splat(o->own_z)));
}

// Between two places where a ray's component is -1 and 1.
INLINE span span_of_slab(real from, real way) {
    const real share = R(1.0) / divisor(way), a = (R(-1.0) - from) * share, b = (R(1.0) - from) * share;
    const span s = {fmin(a, b), fmax(a, b)};
    return s;
}

INLINE span span_of_both(span a, span b) {
    const span s = {fmax(a.entry, b.entry), fmin(a.exit, b.exit)};
    return s;
}

// In the ball of radius 1: by the way's nearest place to the middle, since b^2 - c would cancel for a far-off origin.
INLINE span span_of_ball(vec from, vec way) {
    const real share = R(1.0) / fmax(sqrt(vec_dot(way, way)), R(1e-30));
    const vec along = vec_scale(way, share);
    const real middle = -vec_dot(from, along);
    const vec nearest = vec_along(from, middle, along);
    const real square = R(1.0) - vec_dot(nearest, nearest), half_chord = sqrt(fmax(square, R(0.0)));
    const mask meets = less(R(0.0), square);
    const span s = {pick(meets, (middle - half_chord) * share, R(1.0)), pick(meets, (middle + half_chord) * share, R(-1.0))};
    return s;
}

INLINE span span_of_tube(vec from, vec way) {
    // A way along the axis is in the tube everywhere, or nowhere.
    const real across = way.x * way.x + way.y * way.y, distance = from.x * from.x + from.y * from.y;
    const mask level = less(across, R(1e-14) * (across + way.z * way.z));
    const mask in = less(distance, R(1.0));
    const span disc = span_of_ball(vec_of(from.x, from.y, R(0.0)), vec_of(way.x, way.y, R(0.0)));
    const real all = (real)(REAL_LARGEST);
    const span s = {pick(level, pick(in, -all, R(1.0)), disc.entry), pick(level, pick(in, all, R(-1.0)), disc.exit)};
    return s;
}

// Where a ray enters and leaves a solid, or what is below a plane.
INLINE span object_span(__global const struct Object *o, vec origin, vec direction) {
    const vec from = object_own(o, vec_sub(origin, vec_splat(o->middle))), way = object_own(o, direction);
    if (o->kind == OBJECT_SPHERE) return span_of_ball(from, way);
    if (o->kind == OBJECT_BOX || o->kind == OBJECT_VOLUME || o->kind == OBJECT_CLOUD) {
        return span_of_both(span_of_both(span_of_slab(from.x, way.x), span_of_slab(from.y, way.y)), span_of_slab(from.z, way.z));
    }
    if (o->kind == OBJECT_CYLINDER) return span_of_both(span_of_tube(from, way), span_of_slab(from.z, way.z));
    const real t = -from.z / divisor(way.z), all = (real)(REAL_LARGEST);
    const mask down = less(way.z, R(0.0));
    const span s = {pick(down, t, -all), pick(down, all, t)};
    return s;
}

// The first place of a span's rim on a ray, or the largest number: where it enters a solid, or from inside where it leaves it.
INLINE real span_first(span s) {
    const real first = pick(less(R(0.0), s.entry), s.entry, s.exit);
    return pick(less(s.entry, s.exit) & less(R(0.0), first), first, (real)(REAL_LARGEST));
}

#include "object_grids.h"

// Objects with a boundary that an equation tells at once.
INLINE int is_met_by_span(__global const struct Object *o) {
    return o->kind != OBJECT_WATER && o->kind != OBJECT_JOINED && o->kind != OBJECT_VOLUME && o->kind != OBJECT_CLOUD;
}

// Where a ray meets the object with index `i`, of which planes may leave a part only. `face`: the plane whose cut it meets there, or -1.
INLINE real object_met(int i, vec origin, vec direction, __global const struct Object *objects, plane_set planes, real *face) {
    span s = object_span(objects + i, origin, direction);
    real begins = R(-1.0), ends = R(-1.0);
    for (int plane = 0; plane < planes.count; ++plane) {
        if (!plane_cuts(planes.planes + plane, i)) continue;
        const real exit = s.exit;
        plane_cut(planes.planes + plane, plane, origin, direction, &s.entry, &s.exit, &begins);
        ends = pick(less(s.exit, exit), (real)((scalar)plane), ends);
    }
    *face = pick(less(R(0.0), s.entry), begins, ends);
    return span_first(s);
}

// The nearest object that a ray meets before its `far`: how far it is, or the largest number; and its number from 1, or 0.
CALLED real objects_met(const ray *r, __global const struct Object *objects, plane_set planes, int count, __global const float *tables,
                        real *number) {
    real nearest = (real)(REAL_LARGEST);
    *number = R(0.0);
    for (int i = 0; i < count; ++i) {
        if (!is_met_by_span(objects + i)) continue;
        real face;
        const real t = object_met(i, r->origin, r->direction, objects, planes, &face);
        const mask here = less(t, nearest) & less(t, r->far);
        nearest = pick(here, t, nearest);
        *number = pick(here, (real)((scalar)(i + 1)), *number);
    }
    // Waves are searched: only before all else.
    for (int i = 0; i < count; ++i) {
        if (objects[i].kind != OBJECT_WATER) continue;
        const vec from = object_own(objects + i, vec_sub(r->origin, vec_splat(objects[i].middle)));
        const real t = water_met(objects + i, from, object_own(objects + i, r->direction), fmin(nearest, r->far), r->footprint, r->spread);
        const mask here = less(t, nearest) & less(t, r->far);
        nearest = pick(here, t, nearest);
        *number = pick(here, (real)((scalar)(i + 1)), *number);
    }
    // So are values on grids.
    for (int i = 0; i < count; ++i) {
        if (objects[i].kind != OBJECT_VOLUME) continue;
        const real t = level_met(objects + i, tables, r->origin, r->direction, fmin(nearest, r->far));
        const mask here = less(t, nearest) & less(t, r->far);
        nearest = pick(here, t, nearest);
        *number = pick(here, (real)((scalar)(i + 1)), *number);
    }
    return nearest;
}

// The normal at a place of an object's surface, length 1, away from its inside.
INLINE vec object_normal(__global const struct Object *o, vec point, __global const float *tables) {
    const vec own = object_own(o, vec_sub(point, vec_splat(o->middle)));
    vec n = vec_of(R(0.0), R(0.0), R(1.0));
    if (o->kind == OBJECT_SPHERE) {
        n = own;
    } else if (o->kind == OBJECT_BOX) {
        const real x = fabs(own.x), y = fabs(own.y), z = fabs(own.z);
        const mask by_x = less_equal(y, x) & less_equal(z, x), by_y = ~by_x & less_equal(z, y);
        n = vec_of(pick(by_x, own.x, R(0.0)), pick(by_y, own.y, R(0.0)), pick(by_x | by_y, R(0.0), own.z));
    } else if (o->kind == OBJECT_CYLINDER) {
        const mask lid = less(own.x * own.x + own.y * own.y, own.z * own.z);
        n = vec_of(pick(lid, R(0.0), own.x), pick(lid, R(0.0), own.y), pick(lid, own.z, R(0.0)));
    }
    if (o->kind == OBJECT_WATER) n = water_normal(o, own.x, own.y);
    if (o->kind == OBJECT_VOLUME) {
        // What places are rounded to, in units of the box.
        const real far_out = fmax(fmax(fabs(point.x), fabs(point.y)), fabs(point.z));
        const scalar thinnest = fmin(fmin(o->sides[0], o->sides[1]), o->sides[2]);
        n = level_normal(o, tables, own, R(16.0) * (real)(REAL_EPSILON) * (R(1.0) + far_out / (real)(thinnest)));
    }
    // A normal goes from its own units to scene units by the transposed matrix.
    const vec x = vec_scale(vec_splat(o->own_x), n.x), y = vec_scale(vec_splat(o->own_y), n.y);
    return vec_normalize(vec_add(vec_add(x, y), vec_scale(vec_splat(o->own_z), n.z)));
}

// A place that a ray has met of an object's surface, without the rounding of the way there: as near to the surface as numbers can be.
// (Of grids it stays as it was found.)
INLINE vec object_place(__global const struct Object *o, vec point) {
    const vec own = object_own(o, vec_sub(point, vec_splat(o->middle)));
    vec on = own;
    const real square = own.x * own.x + own.y * own.y;
    if (o->kind == OBJECT_SPHERE) {
        on = vec_scale(own, R(1.0) / fmax(sqrt(square + own.z * own.z), R(1e-30)));
    } else if (o->kind == OBJECT_BOX) {
        const real x = fabs(own.x), y = fabs(own.y), z = fabs(own.z), largest = fmax(fmax(x, y), z);
        on = vec_of(pick(less(x, largest), own.x, copysign(R(1.0), own.x)), pick(less(y, largest), own.y, copysign(R(1.0), own.y)),
                    pick(less(z, largest), own.z, copysign(R(1.0), own.z)));
    } else if (o->kind == OBJECT_CYLINDER) {
        const mask lid = less(square, own.z * own.z);
        const real thinner = pick(lid, R(1.0), R(1.0) / fmax(sqrt(square), R(1e-30)));
        on = vec_of(own.x * thinner, own.y * thinner, pick(lid, copysign(R(1.0), own.z), own.z));
    } else if (o->kind == OBJECT_PLANE) {
        on.z = R(0.0);
    }
    real unused;
    if (o->kind == OBJECT_WATER) on.z = water_height(o, own.x, own.y, own, &unused);
    // Each of its axes is as long as a side, and its own number is the product with the axis by the side's square.
    const vec off = vec_sub(on, own);
    point = vec_along(point, off.x * (real)(o->sides[0] * o->sides[0]), vec_splat(o->own_x));
    point = vec_along(point, off.y * (real)(o->sides[1] * o->sides[1]), vec_splat(o->own_y));
    return vec_along(point, off.z * (real)(o->sides[2] * o->sides[2]), vec_splat(o->own_z));
}

// Whether a place is inside an object, or below a plane.
INLINE mask object_holds(__global const struct Object *o, vec point) {
    const vec own = object_own(o, vec_sub(point, vec_splat(o->middle)));
    const mask low = less(fabs(own.z), R(1.0));
    const real across = own.x * own.x + own.y * own.y;
    if (o->kind == OBJECT_SPHERE) return less(across + own.z * own.z, R(1.0));
    if (o->kind == OBJECT_BOX) return low & less(fabs(own.x), R(1.0)) & less(fabs(own.y), R(1.0));
    if (o->kind == OBJECT_CYLINDER) return low & less(across, R(1.0));
    real unused;
    if (o->kind == OBJECT_WATER) return less(own.z, water_height(o, own.x, own.y, own, &unused));
    return less(own.z, R(0.0));
}

// What a ray has met of the objects with these numbers: where that is the face of a cut its number, normal and place.
INLINE real objects_faced(vec origin, vec direction, real number, __global const struct Object *objects, plane_set planes, int count,
                          vec *normal, vec point, vec *place) {
    real thing = number;
    for (int i = 0; i < count; ++i) {
        const mask here = equal(number, (real)((scalar)(i + 1)));
        if (!any_lane(here)) continue;
        real face;
        object_met(i, origin, direction, objects, planes, &face);
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
CALLED vec objects_place(const vec *point, real number, __global const struct Object *objects, int count) {
    vec place = *point;
    for (int i = 0; i < count; ++i) {
        const mask here = equal(number, (real)((scalar)(i + 1)));
        if (any_lane(here)) place = vec_pick(here, object_place(objects + i, *point), place);
    }
    return place;
}

// The normals of the objects at places of theirs, towards the viewer.
CALLED vec objects_normal(const vec *point, const vec *direction, real number, __global const struct Object *objects, int count,
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
