// What pictures of grids ask the formula by themselves: planes, and normals where rays meet a surface.
#include "formulas/orbits.h"
#include "integrators/volume/volume_sight.h"
#include "formulas/escape.h"
#include "shading/escape_colors.h"
#include "geometry/planes_seen.h"
#include "integrators/volume/volume_exact.h"

INLINE mask cut_objects_hold(int plane, vec point, plane_set set) { return less(R(1.0), R(0.0)); }

INLINE vec normal_there(vec point, vec blended, mask active, world w) {
    return w.settings->exact_normals ? exact_normal(point, blended, active, w) : blended;
}

INLINE mask planes_leave(ray *r, world w) {
    real face;
    return planes_cut(r, &face, w.planes);
}

// The plane at which a ray begins, or -1 where it begins outside the grid.
INLINE real in_grid(ray r, real face, __constant const struct Grid *about) {
    const vec p = grid_own(about, vec_sub(vec_along(r.origin, r.near, r.direction), vec_splat(about->corner)));
    const vec sides = vec_of_counts(about->sides);
    const mask inside = less_equal(R(0.0), fmin(p.x, fmin(p.y, p.z))) & less_equal(p.x, sides.x) & less_equal(p.y, sides.y) &
                        less_equal(p.z, sides.z);
    return pick(inside, face, R(-1.0));
}

INLINE mask face_met(ray *r, mask *active, plane_face *face, world w) {
    real from, body;
    *active &= planes_cut(r, &from, w.planes);
    const mask bare = planes_face(*r, in_grid(*r, from, w.grid.about), *active, w.planes, &face->tint, &face->normal, &face->count, &body);
    *active &= ~bare;
    return bare;
}

// The quads in the picture that are still ahead of a ray.
typedef struct {
    ray along;
    mask wanted;
    plane_hit next;
} quads;

INLINE quads quads_ahead(ray r, mask wanted, world w) {
    return (quads){r, wanted, planes_next(&r, R(-1.0), R(-1.0), wanted, w.planes)};
}

INLINE void sight_quads(sight *s, real until, mask active, quads *q, world w) {
    for (int i = 0; i < w.planes.count; ++i) {
        const mask here = active & less(q->next.distance, until);
        if (!any_lane(here)) return;
        sight_add(s, q->next.tint, q->next.alpha, q->next.distance, q->next.count, q->next.normal, here, here);
        q->next = planes_next(&q->along, pick(here, q->next.distance, q->next.before), pick(here, q->next.index, q->next.after), q->wanted,
                              w.planes);
    }
}

INLINE pixel_sample quads_over(pixel_sample s, ray r, const sight *e, color background, real time, mask wanted, world w) {
    if (w.planes.count == 0) return s;
    const real distance = pick(s.hit, e->t, (real)(REAL_LARGEST));
    return planes_into(s, e->light, background, planes_seen(r, distance, R(-1.0), wanted, w.planes), time, w.view);
}
