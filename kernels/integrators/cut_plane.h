// A sample of a cut plane: what it reads, and what it finds.
#include "formulas/orbits.h"
#include "integrators/view.h"
#include "integrators/sampling.h"
#include "shading/color.h"
#include "integrators/tiles.h"
#include "integrators/pixel.h"
#include "formulas/escape.h"
#include "shading/escape_colors.h"

typedef struct {
    view_record view;
    __constant const struct Sampling *sampling;
    orbit_record orbit;
    constants k;
    plane_record plane;
    __global const float *palette;
} world;

INLINE pixel_sample take_sample(const packet_pixels *at, real across, real below, int sample, mask active, world w, counters *cost) {
    const real from_center_x = at->x - (real)(w.view->center_x), from_center_y = at->y - (real)(w.view->center_y);
    real time = R(0.0);
    if (w.view->spans > 0) time = shutter_time(at->columns, at->rows, (uint)w.sampling->seed, sample);
    const vec right = VIEW_VEC(w.view, right, time), down = VIEW_VEC(w.view, down, time);
    const vec point = vec_along(vec_along(VIEW_VEC(w.view, center, time), from_center_x + across, right), from_center_y + below, down);
    const escaped e = plane_escape(point, active, w.plane->smooth, w.plane->periodicity, w.plane->iterations, w.orbit, w.k);
    cost->steps += pick(active, R(1.0), R(0.0));
    cost->count += pick(active, e.applications, R(0.0));
    return (pixel_sample){.radiance = escape_color(e, w.plane, w.palette), .hit = active, .coverage = R(1.0), .depth = R(0.0), .point = point,
                  .normal = vec_scale(VIEW_VEC(w.view, axis, time), R(-1.0)), .smooth = e.count, .steps = e.applications};
}
