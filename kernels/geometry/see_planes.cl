// Entry points that know the formula: the cut planes in a picture, where they are visible.
#include "formulas/orbits.h"
#include "integrators/stages.h"
#include "formulas/escape.h"
#include "shading/escape_colors.h"
#include "geometry/planes_seen.h"

INLINE mask cut_objects_hold(int plane, vec point, plane_set set) {
    mask held = less(R(1.0), R(0.0));
    for (int object = 0; object < MOST_OBJECTS; ++object) {
        if (plane_cuts(set.planes + plane, object)) held |= object_holds(set.objects + object, point);
    }
    return held;
}

// Finds where a plane opens the set on the ray that was sent for the next interaction: there its face is met, and no ray goes on. (Of objects
// beside the set stages know that by themselves, see `surface_met`.)
STAGE(find_faces) {
    STAGE_BEGINS(s, w);
    const camera_sample a = camera_sample_kept(s);
    path so_far;
    ray r = path_ray(s, eye_ray(&a, view), a.wanted, &so_far);
    real from, body = R(0.0);
    const mask left = planes_cut(&r, &from, w.planes) & mask_of(so_far.on_path);
    plane_face face = {.t = r.near};
    mask bare = planes_face(r, from, left, w.planes, &face.tint, &face.normal, &face.count, &body);
    if (s.q.objects) bare &= less(face.t, lanes_load(s.q.rays + RAY_OBJECT * s.q.stride + s.slot));
    face.number = pick(bare, face_number(from, thing_of_body(body, w)), R(0.0));
    STATE_KEEP(s, face, STATE_FACE);
    __global scalar *far = s.q.rays + RAY_FAR * s.q.stride + s.slot;
    lanes_store(pick(bare, R(-1.0), lanes_load(far)), far);
}

// Finds the planes in front of and behind the first interactions. Along paths faces have light, and quads have none: there a face hides the
// part of its own quad that is at the same place.
STAGE(find_planes) {
    STAGE_BEGINS(s, w);
    const camera_sample a = camera_sample_kept(s);
    const interaction found = interaction_kept(s, 0);
    const ray r = eye_ray(&a, view);
    const real way = vec_dot(vec_sub(found.seen, r.origin), r.direction);
    const real object = pick(mask_of(found.found), way, (real)(REAL_LARGEST));
    const real hidden = HAS(w, PATHS) ? plane_of_face(found.object) : R(-1.0);
    const plane_layers layers = planes_seen(r, object, hidden, mask_of(a.wanted), w.planes);
    STATE_KEEP(s, layers, STATE_LAYERS);
}
