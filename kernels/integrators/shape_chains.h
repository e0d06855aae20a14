// Where rays cross the boundaries of clear bodies of any shape, and how these bend there.
#include "integrators/chains.h"

INLINE int is_shot(object_record o) { return o->shot; }

CALLED real shape_crossed(object_record o, const vec *from, const vec *way, int leaves) {
    real nearest = (real)(REAL_LARGEST);
    for (int number = 0; number < o->spans; ++number) {
        const span s = object_span(o, ANY_TURN, number, *from, *way);
        const real there = leaves ? s.exit : s.entry;
        nearest = pick(less(s.entry, s.exit) & less(R(0.0), there) & less(there, nearest), there, nearest);
    }
    return pick(less(nearest, (real)(REAL_LARGEST)), nearest, R(-1.0));
}

// A normal goes from its own units to scene units by the transposed matrix, and so does what it changes by.
INLINE chain_site shape_site_at(object_record o, vec place) {
    chain_site s;
    s.own = object_own(o, vec_sub(place, vec_splat(o->middle)));
    const vec normal = vec_of_axes(o, shape_normal(o->kind, vec_splat(o->form), s.own));
    s.share = R(1.0) / fmax(sqrt(vec_dot(normal, normal)), (real)(REAL_SMALLEST));
    s.normal = vec_scale(normal, s.share);
    s.along = s.across = s.both = R(0.0);
    return s;
}

INLINE vec shape_site_turns(object_record o, const chain_site *s, vec way) {
    const vec own = shape_bends(o->kind, vec_splat(o->form), s->own, object_own(o, way));
    const vec turned = vec_scale(vec_of_axes(o, own), s->share);
    return vec_along(turned, -vec_dot(turned, s->normal), s->normal);
}
