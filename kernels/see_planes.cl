// Entry points that know the formula: the cut planes in a picture, where they are visible.
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"
#include "structs.h"
#include "formula.h"
#include "orbit.h"
#include "camera.h"
#include "sampling.h"
#include "shade.h"
#include "tiles.h"
#include "pixel.h"
#include "escape.h"
#include "escape_colors.h"
#include "planes.h"
#include "planes_seen.h"
#include "stage.h"
#include "state.h"
#include "eye.h"

// Finds where a cutting plane opens the set: there its face is visible, and no ray goes on.
STAGE(find_faces) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const aim a = aim_kept(s.state, s.stride);
    ray r = eye_ray(&a, view);
    real from;
    plane_face face;
    const mask left = planes_cut(&r, &from, w.planes) & mask_of(a.wanted);
    face.t = r.near;
    face.count = R(0.0);
    face.tint = color_of(R(0.0), R(0.0), R(0.0));
    face.normal = vec_of(R(0.0), R(0.0), R(0.0));
    mask bare = planes_face(r, from, left, w.planes, &face.tint, &face.normal, &face.count);
#if HAS_OBJECTS
    const ray whole = eye_ray(&a, view);
    real number;
    bare &= less(face.t, objects_met(&whole, w.objects, settings->object_count, w.tables, &number));
#endif
    face.bare = number_of(bare);
    STATE_KEEP(s, face, STATE_FACE);
    __global scalar *far = s.q.rays + RAY_FAR * s.q.stride + s.slot;
    lanes_store(pick(bare, R(-1.0), lanes_load(far)), far);
}

// Finds the planes in front of and behind the first spots.
STAGE(find_planes) {
    if (IS_BEYOND) return;
    STAGE_OF(s);
    const world w = WORLD;
    const aim a = aim_kept(s.state, s.stride);
    const spot found = spot_kept(s.state, 0, s.stride);
    plane_face face;
    STATE_RECALL(s, face, STATE_FACE);
    const ray r = eye_ray(&a, view);
    const mask bare = mask_of(face.bare);
    const vec point = vec_pick(bare, vec_along(r.origin, face.t, r.direction), found.seen);
    const real way = vec_dot(vec_sub(point, r.origin), r.direction);
    const real object = pick(bare | mask_of(found.found), way, (real)(REAL_LARGEST));
    const plane_layers layers = planes_seen(r, object, mask_of(a.wanted), w.planes);
    STATE_KEEP(s, layers, STATE_LAYERS);
}
