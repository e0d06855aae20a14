// Events: where a material scatters paths, whose boundary may let them into its body. In clouds phase functions do (`walk_clouds.cl`): both
// evaluate what is scattered into a direction and with which density it is chosen (`NAME_value`), and sample one (`NAME_sample`).
#include "shading/medium_event.h"

typedef struct {
    vec point, from;      // where it is, and where rays leave it
    vec normal;
    vec before;           // the way of the light that arrives, from the eye
    real own;             // the object whose surface it is, or 0
    mask behind;          // in glass, whether it is seen from inside its body
    bsdf surface;
} event;

// Puts an event where a path has landed, with the normals of the surface and of its side that the path is on.
INLINE void event_placed(event *e, const interaction *here, vec normal, vec outward, world w) {
    e->point = here->point;
    e->from = vec_along(here->point, lift_of(here, w), outward);
    e->normal = normal;
    e->own = here->object;
}

// Events choose by numbers in (0, 1): two for the direction, one for how, one for the wall of a relief.
INLINE onward surface_sample(const bsdf *b, real u, real v, real choice, real wall, world w) {
    onward found;
    color value;
    found.direction = scatter_sample(b, choice, u, v, wall);
    scatter_value(b, &found.direction, w.albedos, &value, &found.density);
    found.goes = less(R(0.0), found.density);
    found.sinks = found.goes & ~found.goes;
    found.part = color_scale(value, R(1.0) / found.density);
    if (HAS(w, SUBSURFACE)) {
        found.sinks = b->seen & less(R(1.0) - b->by_below, choice);
        found.direction = vec_pick(found.sinks, hemisphere_direction(vec_scale(b->surface, R(-1.0)), u, v), found.direction);
        found.part = color_pick(found.sinks, b->below, found.part);
        found.goes |= found.sinks;
    }
    return found;
}

INLINE void event_value(const event *e, vec toward, world w, color *value, real *density) {
    scatter_value(&e->surface, &toward, w.albedos, value, density);
}

INLINE onward event_sample(const event *e, real u, real v, real choice, real wall, world w) {
    return surface_sample(&e->surface, u, v, choice, wall, w);
}
