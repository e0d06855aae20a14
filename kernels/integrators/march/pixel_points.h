// The points of a pixel (Englund 2010, sec. 3.2.3): they share one march up to where the pixel's cone first touches the set;
// from there each finds the surface on its own ray. What they find becomes one interaction: its normals, colour and coverage.
//
// Where positions matter (`geometric`: all normals but the gradient, and the residual) they are kept relative to a point
// of the pixel's ray, in the pixel's frame: x right, y up, z to the viewer.
typedef struct {
    bits seed;
    real cone;                  // the pixel's, where the shared march ended, or at the object that is seen
    real count;                 // points that found the surface
    real nearest;               // of those, the one nearest to the middle: its distance squared, in pixels
    vec point, base, normal;    // base: where it is shaded
    real smooth, object, other, share;
    color tint;                 // sum over the points
    vec reference, right, up, toward;
    plane_sums sums;
    vec compass[9];             // corners, edges and middle of the grid, row by row from the top left
    mask compass_found[9];
} pixel_points;

// The middle one first.
INLINE int point_of_turn(int turn, int count) { return (turn + count / 2) % count; }

// Each sample of a pixel has points of its own.
INLINE bits points_seed(const packet_pixels *at, int sample, world w) {
    return pixel_seed(at->columns, at->rows, (uint)w.settings->seed + (uint)sample * 0x9e3779b9u, PURPOSE_POINTS);
}

INLINE pixel_points points_begin(ray pixel_ray, real time, touch touched, bits seed, world w) {
    pixel_points p = {.seed = seed, .cone = pixel_ray.footprint + pixel_ray.spread * touched.t, .nearest = (real)(REAL_LARGEST),
                      .point = pixel_ray.origin, .base = pixel_ray.origin, .normal = pixel_ray.direction,
                      .reference = vec_along(pixel_ray.origin, touched.t, pixel_ray.direction),
                      .toward = vec_scale(pixel_ray.direction, R(-1.0)), .sums = plane_none()};
    const vec side = VIEW_VEC(w.view, side, time);
    p.right = vec_normalize(vec_along(side, -vec_dot(side, p.toward), p.toward));
    p.up = vec_cross(p.toward, p.right);
    return p;
}

// Whether points of a packet may meet anything. Past the set they may still meet objects.
INLINE int points_may_meet(stage s, touch touched) { return s.q.objects || any_lane(mask_of(touched.touched)); }

INLINE void points_skip(stage s, world w) {
    for (int turn = 0; turn < w.settings->point_count; ++turn) queue_skip(s.q, turn, s.slot);
}

// Sends a ray for each point, from a little before where the pixel's cone touched on (for the search by steps: from the eye).
INLINE void points_send(stage s, camera_sample a, touch touched, ray pixel_ray, bits seed, world w) {
    const real cone = pixel_ray.footprint + pixel_ray.spread * touched.t;
    const int count = w.settings->point_count;
    for (int turn = 0; turn < count; ++turn) {
        real across, below;
        point_offset(point_of_turn(turn, count), count, w.settings->point_rows, seed, &across, &below);
        ray r = camera_ray(a.x + across, a.y + below, a.lens_x, a.lens_y, a.time, w.view);
        r.near = fmax(touched.t - (real)(w.settings->point_start) * cone, R(0.0));
        r.known = touched.t;
        const real free = pick(mask_of(touched.touched), R(0.0), (real)(REAL_LARGEST));
        send_clipped(s, turn, r, free, WHICH, mask_of(a.wanted), w);
    }
}

INLINE void points_place(pixel_points *p, int point, int rows, mask found, vec place_of_point) {
    const vec offset = vec_sub(place_of_point, p->reference);
    const vec place = vec_of(vec_dot(offset, p->right), vec_dot(offset, p->up), vec_dot(offset, p->toward));
    p->sums = plane_add(p->sums, found, place);
    if (rows % 2 == 0 || rows < 3) return;
    const int column = point % rows, row = point / rows, half_side = rows / 2;
    if (column % half_side == 0 && row % half_side == 0) {
        const int at = 3 * (row / half_side) + column / half_side;
        p->compass[at] = place;
        p->compass_found[at] = found;
    }
}

INLINE void points_add(stage s, pixel_points *p, int turn, ray r, ray_hit met, real object, vec base, world w) {
    const mask found = mask_of(met.hit);
    const vec point = vec_along(r.origin, met.t, r.direction);
    p->count += met.hit;
    real across, below;
    const int count = w.settings->point_count, number = point_of_turn(turn, count);
    point_offset(number, count, w.settings->point_rows, p->seed, &across, &below);
    const real offset = across * across + below * below;
    const mask nearer = found & less(offset, p->nearest);
    p->nearest = pick(nearer, offset, p->nearest);
    p->point = vec_pick(nearer, point, p->point);
    p->base = vec_pick(nearer, base, p->base);
    p->normal = vec_pick(nearer, met.normal, p->normal);
    p->smooth = pick(nearer, met.smooth, p->smooth);
    // The shared march knows nothing of objects: where it ended says nothing of how wide the cone is at one.
    p->cone = pick(nearer & ~of_the_set(object, w), r.footprint + r.spread * met.t, p->cone);
    p->object = pick(nearer, object, p->object);
    p->other = pick(nearer, met.other, p->other);
    p->share = pick(nearer, met.part, p->share);
    if (is_colored_at_once(w.material)) {
        const color tint = interaction_color(met.normal, met.smooth, object, met.other, met.part, w);
        p->tint = color_pick(found, color_add(p->tint, tint), p->tint);
    }
    if (w.settings->geometric) points_place(p, number, w.settings->point_rows, found, base);
    if (w.settings->normal == NORMAL_GRADIENT) {
        const facet f = {vec_pick(found, met.normal, r.direction), met.hit};
        STATE_KEEP_ONE(s, f, STATE_FACET, turn);
    }
}

// Of a packet whose points meet nothing no normal counts. The result is how many points are added.
INLINE int points_none(stage s, ray pixel_ray, world w) {
    const facet f = {pixel_ray.direction, R(0.0)};
    if (w.settings->normal != NORMAL_GRADIENT) return 0;
    for (int i = 0; i < w.settings->point_count; ++i) STATE_KEEP_ONE(s, f, STATE_FACET, i);
    return 0;
}

INLINE vec points_to_space(const pixel_points *p, vec a) {
    return vec_along(vec_along(vec_scale(p->right, a.x), a.y, p->up), a.z, p->toward);
}

// Keeps the normals of the triangles whose points have all been found, or `instead` where there is none.
INLINE void points_triangles(stage s, const pixel_points *p, vec instead) {
    vec around[8];
    mask whole[8];
    eight_normals(p->compass, p->compass_found, around, whole);
    real number = R(0.0);
    for (int i = 0; i < TURNS(8); ++i) number += number_of(whole[i]);
    const mask some = less(R(0.0), number);
    for (int i = 0; i < TURNS(8); ++i) {
        const facet f = {vec_pick(whole[i], points_to_space(p, around[i]), instead),
                         pick(some, pick(whole[i], R(1.0) / number, R(0.0)), R(0.125))};
        STATE_KEEP_ONE(s, f, STATE_FACET, i);
    }
}

// The interaction that stands for the pixel. Where points are missing or lie on a line the normal is made from what is left: by least
// squares, or else that of the middle one.
INLINE interaction points_interaction(stage s, const pixel_points *p, world w) {
    const real share = R(1.0) / fmax(p->count, R(1.0));
    interaction here = {.found = number_of(less(R(0.0), p->count)), .point = p->base, .seen = p->point, .normal = p->normal,
                 .smooth = p->smooth, .object = p->object, .other = p->other, .share = p->share, .cone = p->cone,
                 .tint = color_scale(p->tint, share), .residual = R(0.0), .quantity = R(0.0)};
    // (Of the set it is found later; that of a cut object's face only here.)
    if (!is_colored_at_once(w.material)) here.tint = interaction_color(p->normal, p->smooth, p->object, p->other, p->share, w);
    mask usable = less(R(1.0), R(0.0));
    if (w.settings->geometric) {
        real residual;
        const vec plane = points_to_space(p, normal_of_plane(p->sums, &residual, &usable));
        here.residual = residual / p->cone;
        vec made = plane;
        if (w.settings->normal == NORMAL_ONE_TRIANGLE) made = points_to_space(p, triangle_normal(p->compass, p->compass_found, &usable));
        if (w.settings->normal == NORMAL_EIGHT_TRIANGLES_NORMAL || w.settings->normal == NORMAL_EIGHT_TRIANGLES_SHADING) {
            made = points_to_space(p, eight_mean(p->compass, p->compass_found, &usable));
        }
        if (w.settings->normal != NORMAL_GRADIENT) here.normal = vec_pick(usable, made, here.normal);
    }
    if (w.settings->normal == NORMAL_EIGHT_TRIANGLES_SHADING) points_triangles(s, p, here.normal);
    if (w.settings->normal == NORMAL_GRADIENT) {
        for (int i = 0; i < w.settings->point_count; ++i) {
            facet f;
            STATE_RECALL_ONE(s, f, STATE_FACET, i);
            f.weight *= share;
            STATE_KEEP_ONE(s, f, STATE_FACET, i);
        }
    }
    return here;
}
