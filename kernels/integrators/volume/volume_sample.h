// One sample of a volume's pixel.
#include "integrators/volume/volume_light.h"

// What a ray sees of the grid, and of the planes between, for lanes `wanted`; those that are `bare` see the face of a plane where the ray
// begins, and those that are `active` the grid.
INLINE void sight_grid(sight *e, ray r, grid_ray g, mask active, mask bare, const plane_face *face, mask wanted, world w, real *looked);

// What is behind all.
INLINE color background_of(real y, world w) {
    if (w.material->transparent) return color_of(R(0.0), R(0.0), R(0.0));
    const real share = clamp(y / (real)((scalar)w.view->height), R(0.0), R(1.0));
    return color_mix(color_splat(w.material->background_top), color_splat(w.material->background_bottom), share);
}

// What is seen along a ray from row `y` of the picture.
INLINE pixel_sample volume_sample(ray r, real y, real time, mask wanted, world w, sight *e, real *steps) {
    ray kept = r;
    mask active = wanted;
    plane_face face = {R(0.0), R(0.0), R(0.0), color_of(R(0.0), R(0.0), R(0.0)), vec_scale(r.direction, R(-1.0))};
    const mask bare = face_met(&kept, &active, &face, w);
    face.t = kept.near;
    grid_ray g;
    active &= enter(kept, w, &g);
    const mask nowhere = active & ~active;
    real looked = R(0.0);
    const sight nothing = {color_of(R(0.0), R(0.0), R(0.0)), R(1.0), R(0.0), R(0.0), vec_of(R(0.0), R(0.0), R(0.0)), nowhere, nowhere, nowhere};
    *e = nothing;
    sight_grid(e, r, g, active, bare, &face, wanted, w, &looked);
    const color background = background_of(y, w);
    const real told = e->value * (real)(w.settings->value_scale) + (real)(w.settings->value_offset);
    pixel_sample s = {.radiance = color_add(e->light, color_scale(background, e->through)), .hit = e->found, .coverage = R(1.0) - e->through,
              .normal = e->normal, .point = vec_along(r.origin, e->t, r.direction), .smooth = pick(e->on_plane, e->value, told),
              .steps = looked};
    s.depth = depth_of(s.point, time, w.view);
    *steps += looked;
    return s;
}
