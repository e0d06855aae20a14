// Rays of a view, through a lens or not.
#include "integrators/view.h"

// One View makes all rays: a plane with an eye behind it, at infinity for an orthographic camera.
typedef struct {
    vec origin;       // scene units
    vec direction;    // length 1
    real near, far;   // the part of the ray to search, distances from the origin
    real footprint;   // a pixel's width at distance 0 ...
    real spread;      // ... and how much it grows per unit of distance
    real known;       // distance of a hit that is proved already, on a ray of the same pixel
} ray;

#define RAY_NOTHING_KNOWN ((real)(REAL_LARGEST))

// The ray through the picture at (x, y), in pixels from the top left corner, and through the lens at (lens_x, lens_y), in
// lens radii from its middle; `time` is when the shutter lets it in (see view.h).
INLINE ray camera_ray(real x, real y, real lens_x, real lens_y, real time, view_record view) {
    const real across = x - (real)(view->center_x);
    const real below = y - (real)(view->center_y);
    const vec on_plane = vec_along(vec_along(VIEW_VEC(view, center, time), across, VIEW_VEC(view, right, time)), below,
                                   VIEW_VEC(view, down, time));
    ray r = {.far = (real)(REAL_LARGEST), .known = RAY_NOTHING_KNOWN};
    if (view->perspective) {
        // Relative to the eye, so that a far-off camera loses no more digits than it must.
        r.origin = VIEW_VEC(view, eye, time);
        const vec from_eye = vec_sub(on_plane, r.origin);
        const real inverse = R(1.0) / sqrt(vec_dot(from_eye, from_eye));
        r.direction = vec_scale(from_eye, inverse);
        r.spread = VIEW_NUMBER(view, pixel_size, time) * inverse;
        if (!view->has_lens) return r;
        // A thin lens: whatever its point, all rays of a pixel meet again in the plane of focus.
        const real to_focus = VIEW_NUMBER(view, focus_distance, time) / vec_dot(r.direction, VIEW_VEC(view, axis, time));
        const real lens_radius = VIEW_NUMBER(view, lens_radius, time);
        const vec on_lens = vec_along(vec_along(vec_of(R(0.0), R(0.0), R(0.0)), lens_x * lens_radius, VIEW_VEC(view, side, time)),
                                      lens_y * lens_radius, VIEW_VEC(view, up, time));
        r.direction = vec_normalize(vec_sub(vec_scale(r.direction, to_focus), on_lens));
        r.origin = vec_add(r.origin, on_lens);
    } else {
        r.origin = on_plane;
        r.direction = VIEW_VEC(view, axis, time);
        r.footprint = VIEW_NUMBER(view, pixel_size, time);
    }
    return r;
}

// Cuts a ray to the formula's bounding sphere; lanes that miss it are not in the result.
INLINE mask ray_clip(ray *r, __constant const scalar *center, real radius) {
    const vec offset = vec_sub(r->origin, vec_splat(center));
    const real middle = -vec_dot(offset, r->direction);
    // Distance of the ray from the centre, by the perpendicular: b^2 - c would cancel for a far-off origin.
    const vec nearest = vec_along(offset, middle, r->direction);
    const real half_square = radius * radius - vec_dot(nearest, nearest);
    const real half_chord = sqrt(most(R(0.0), half_square));
    r->near = most(r->near, middle - half_chord);
    r->far = least(middle + half_chord, r->far);
    return less(R(0.0), half_square) & less(r->near, r->far);
}

// How far a point lies from the eye along the view's axis.
INLINE real depth_of(vec point, real time, view_record view) {
    return vec_dot(vec_sub(point, VIEW_VEC(view, eye, time)), VIEW_VEC(view, axis, time));
}
