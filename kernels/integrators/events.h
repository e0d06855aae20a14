// Events: where paths are scattered. At a surface a material scatters them, whose boundary may let them into its body; elsewhere a medium.
// Each kind evaluates what it scatters into a direction and with which density it chooses that (`NAME_value`), and samples one
// (`NAME_sample`). The lanes of a packet may have events of several kinds: each is asked where any lane has it.
#include "shading/medium_event.h"

typedef struct {
    mask in_medium;       // else at a surface
    vec point, from;      // where it is, and where rays leave it
    vec normal;           // zero within a medium
    real own;             // the object whose surface it is, or 0
    mask shut;            // whether a boundary is around it that would bend the way to lights: nobody asks for these
    mask behind;          // of a surface: in glass, whether it is seen from inside its body
    bsdf surface;
    medium_event medium;
} event;

// Puts an event where a path has landed, with the normals of the surface and of its side that the path is on; or `in_medium`, where it is.
INLINE void event_placed(event *e, vec origin, const interaction *here, vec normal, vec outward, mask in_medium, world w) {
    const real nowhere = R(0.0);
    e->in_medium = in_medium;
    e->point = vec_pick(in_medium, origin, here->point);
    e->from = vec_pick(in_medium, origin, vec_along(here->point, lift_of(here, w), outward));
    e->normal = vec_pick(in_medium, vec_of(nowhere, nowhere, nowhere), normal);
    e->own = pick(in_medium, nowhere, here->object);
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
    if (any_lane(~e->in_medium)) scatter_value(&e->surface, &toward, w.albedos, value, density);
    if (!any_lane(e->in_medium)) return;
    color scattered;
    real phase;
    medium_value(&e->medium, toward, &scattered, &phase);
    *value = color_pick(e->in_medium, scattered, *value);
    *density = pick(e->in_medium, phase, *density);
}

INLINE onward event_sample(const event *e, real u, real v, real choice, real wall, world w) {
    onward found;
    if (any_lane(~e->in_medium)) found = surface_sample(&e->surface, u, v, choice, wall, w);
    if (!any_lane(e->in_medium)) return found;
    const onward scattered = medium_sample(&e->medium, u, v);
    found.direction = vec_pick(e->in_medium, scattered.direction, found.direction);
    found.density = pick(e->in_medium, scattered.density, found.density);
    found.part = color_pick(e->in_medium, scattered.part, found.part);
    found.goes |= e->in_medium;
    found.sinks &= ~e->in_medium;
    return found;
}
