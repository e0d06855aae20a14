// Cut planes in the picture of an object, at the end of a sample.
#include "geometry/plane_cuts.h"

// Puts the planes into a sample whose radiance is still that of the object alone, not over any background.
INLINE pixel_sample planes_into(pixel_sample s, color object, color background, plane_layers layers, real time, view_record view) {
    const color far = color_add(layers.behind, color_scale(background, layers.behind_through));
    const color middle = color_mix(far, object, s.coverage);
    s.radiance = color_add(layers.front, color_scale(middle, layers.front_through));
    s.coverage = R(1.0) - layers.front_through * (R(1.0) - s.coverage) * layers.behind_through;
    const mask seen = less(layers.nearest, (real)(REAL_LARGEST));
    s.hit |= seen;
    s.point = vec_pick(seen, layers.point, s.point);
    s.normal = vec_pick(seen, layers.normal, s.normal);
    s.smooth = pick(seen, layers.count, s.smooth);
    s.depth = pick(seen, depth_of(layers.point, time, view), s.depth);
    return s;
}
