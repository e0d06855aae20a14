// Entry point of light along paths through a medium in a grid.
#include "integrators/volume/volume.h"
#include "shading/environment.h"
#include "shading/sky.h"
#include "shading/light_places.h"
#include "shading/lights.h"
#include "shading/light_sampling.h"
#include "integrators/volume/volume_paths.h"

// Beside a grid are neither objects that shine nor lights on a set.
INLINE mask met_on_set(vec origin, vec direction, int of_eye, real *far, color *shows, real *density, real *weight, world w) { return less(R(1.0), R(0.0)); }
INLINE real with_lights_beside(real sum, vec point, real own, world w) { return sum; }
INLINE void sample_lights_beside(choosing *c, const real *numbers, world w) {}

INLINE pixel_sample take_sample(const packet_pixels *at, real across, real below, int sample, mask active, world w, counters *cost) {
    real time;
    const ray r = sample_ray(at, across, below, sample, w, &time);
    return take_path(at, r, at->y + below, time, sample, active, w, &cost->steps);
}

VOLUME(volume_paths)
