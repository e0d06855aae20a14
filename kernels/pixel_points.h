// The points of a pixel (Englund 2010, sec. 3.2.3): they share one march up to where the pixel's cone first touches the set;
// from there each finds the surface on its own ray. What they find becomes one spot: its normals, colour and coverage.
//
// GEOMETRIC says that positions matter (all normals but the gradient, and the residual): they are kept relative to a point
// of the pixel's ray, in the pixel's frame: x right, y up, z to the viewer.
#if POINTS > 1
typedef struct {
    mask touched;
    real touch_t, touch_cone;   // of the shared march, and the pixel's cone there
    bits seed;
    real count;                 // points that found the surface
    real nearest;               // of those, the one nearest to the middle: its distance squared, in pixels
    vec point, base, normal;
    real smooth;
    color tint;                 // sum over the points
#if GEOMETRIC
    vec reference, right, up, toward;
    plane_sums sums;
    vec compass[9];             // corners, edges and middle of the grid, row by row from the top left
    mask compass_found[9];
#endif
#if NORMAL == NORMAL_GRADIENT
    vec normals[POINTS];
    real weights[POINTS];
#endif
} pixel_points;

INLINE int point_of_turn(int turn) { return (turn + POINTS / 2) % POINTS; }

INLINE pixel_points points_begin(const int *columns, const int *rows, int sample, uint seed) {
    pixel_points p;
    // Each sample of a pixel has points of its own.
    p.seed = pixel_seed(columns, rows, seed + (uint)sample * 0x9e3779b9u, PURPOSE_POINTS);
    return p;
}

INLINE void points_touched(pixel_points *p, crossing met, ray eye_ray, world w) {
    p->touched = met.hit;
    p->touch_t = met.t;
    p->touch_cone = eye_ray.footprint + eye_ray.spread * met.t;
    p->count = R(0.0);
    p->nearest = (real)(REAL_LARGEST);
    p->point = eye_ray.origin;
    p->base = eye_ray.origin;
    p->normal = eye_ray.direction;
    p->smooth = R(0.0);
    p->tint = color_of(R(0.0), R(0.0), R(0.0));
#if GEOMETRIC
    p->reference = vec_along(eye_ray.origin, met.t, eye_ray.direction);
    p->toward = vec_scale(eye_ray.direction, R(-1.0));
    const vec side = vec_splat(w.view->side);
    p->right = vec_normalize(vec_along(side, -vec_dot(side, p->toward), p->toward));
    p->up = vec_cross(p->toward, p->right);
    p->sums = plane_none();
    for (int i = 0; i < TURNS(9); ++i) {
        p->compass[i] = vec_of(R(0.0), R(0.0), R(0.0));
        p->compass_found[i] = met.hit & ~met.hit;
    }
#endif
}

// The ray of a point, from half a footprint before where the pixel's cone touched on.
INLINE ray points_ray(pixel_points *p, int turn, real x, real y, real lens_x, real lens_y, world w) {
    real across, below;
    point_offset(point_of_turn(turn), p->seed, &across, &below);
    ray r = camera_ray(x + across, y + below, lens_x, lens_y, w.view);
#if SEARCH == SEARCH_STEPS
    r.known = p->touch_t;
#else
    r.near = fmax(p->touch_t - R(0.5) * p->touch_cone, R(0.0));
    r.known = p->touch_t;
#endif
    return r;
}

INLINE void points_add(pixel_points *p, int turn, ray leg, crossing met, vec normal, real smooth, world w) {
    const mask found = met.hit;
    const vec point = vec_along(leg.origin, met.t, leg.direction), base = vec_along(leg.origin, met.touch, leg.direction);
    p->count += pick(found, R(1.0), R(0.0));
    real across, below;
    point_offset(point_of_turn(turn), p->seed, &across, &below);
    const real offset = across * across + below * below;
    const mask nearer = found & less(offset, p->nearest);
    p->nearest = pick(nearer, offset, p->nearest);
    p->point = vec_pick(nearer, point, p->point);
    p->base = vec_pick(nearer, base, p->base);
    p->normal = vec_pick(nearer, normal, p->normal);
    p->smooth = pick(nearer, smooth, p->smooth);
#if COLORING_PER_POINT
    const color tint = surface_color(normal, smooth, w.material, w.palette);
    p->tint = color_pick(found, color_add(p->tint, tint), p->tint);
#endif
#if GEOMETRIC
    const vec offset_in_space = vec_sub(base, p->reference);
    const vec place = vec_of(vec_dot(offset_in_space, p->right), vec_dot(offset_in_space, p->up),
                             vec_dot(offset_in_space, p->toward));
    p->sums = plane_add(p->sums, found, place);
#if POINT_PATTERN == PATTERN_GRID && POINT_SIDE % 2 == 1 && POINT_SIDE > 1
    const int column = point_of_turn(turn) % POINT_SIDE, row = point_of_turn(turn) / POINT_SIDE;
    const int half_side = POINT_SIDE / 2;
    if (column % half_side == 0 && row % half_side == 0) {
        const int at = 3 * (row / half_side) + column / half_side;
        p->compass[at] = place;
        p->compass_found[at] = found;
    }
#endif
#endif
#if NORMAL == NORMAL_GRADIENT
    p->normals[turn] = normal;
    p->weights[turn] = pick(found, R(1.0), R(0.0));
#endif
}

#if GEOMETRIC
INLINE vec points_to_space(const pixel_points *p, vec a) {
    return vec_along(vec_along(vec_scale(p->right, a.x), a.y, p->up), a.z, p->toward);
}
#endif

// The spot that stands for the pixel. Where points are missing or lie on a line the normal is made from what is left: by least
// squares, or else that of the middle one.
INLINE mask points_spot(const pixel_points *p, ray eye_ray, spot *here, real *coverage, world w) {
    const mask found = less(R(0.0), p->count);
    *coverage = p->count * (R(1.0) / (real)(POINTS));
    const real share = R(1.0) / fmax(p->count, R(1.0));
    here->point = p->base;
    here->smooth = p->smooth;
    here->cone = p->touch_cone;
    here->tint = color_scale(p->tint, share);
    here->normal = p->normal;
    here->residual = R(0.0);
#if GEOMETRIC
    mask usable;
    real residual;
    const vec plane = points_to_space(p, plane_normal(p->sums, &residual, &usable));
    here->residual = residual / p->touch_cone;
#endif
#if NORMAL == NORMAL_GRADIENT
    for (int i = 0; i < TURNS(POINTS); ++i) {
        here->normals[i] = p->normals[i];
        here->weights[i] = p->weights[i] * share;
    }
#else
#if NORMAL == NORMAL_LEAST_SQUARES
    here->normal = vec_pick(usable, plane, here->normal);
#elif NORMAL == NORMAL_ONE_TRIANGLE
    const vec triangle = triangle_normal(p->compass, p->compass_found, &usable);
    here->normal = vec_pick(usable, points_to_space(p, triangle), here->normal);
#else
    const vec mean = eight_mean(p->compass, p->compass_found, &usable);
    here->normal = vec_pick(usable, points_to_space(p, mean), here->normal);
#endif
    here->normals[0] = here->normal;
    here->weights[0] = R(1.0);
#if NORMAL == NORMAL_EIGHT_TRIANGLES_SHADING
    vec around[8];
    mask whole[8];
    eight_normals(p->compass, p->compass_found, around, whole);
    real number = R(0.0);
    for (int i = 0; i < TURNS(8); ++i) number += pick(whole[i], R(1.0), R(0.0));
    const mask some = less(R(0.0), number);
    for (int i = 0; i < TURNS(8); ++i) {
        here->normals[i] = vec_pick(whole[i], points_to_space(p, around[i]), here->normal);
        here->weights[i] = pick(some, pick(whole[i], R(1.0) / number, R(0.0)), R(0.125));
    }
#endif
#endif
    return found;
}
#endif
