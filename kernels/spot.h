// The data that a shot reads, the spot of the surface that it finds, and the spot's properties.
#define COLORING_PER_POINT \
    (COLORING == COLORING_SOLID || COLORING == COLORING_NORMAL || COLORING == COLORING_ITERATIONS)

// All data that a shot reads.
typedef struct {
    __constant const struct View *view;
    __constant const struct March *settings;
    __constant const struct Orbit *orbit;
    __constant const scalar *k;
    __constant const struct Material *material;
    __constant const struct Light *lights;
    __global const float *palette;
    __global const float *environment;
#if PLANES > 0
    plane_set planes;
#endif
} world;

// A place on the surface, and how it looks.
typedef struct {
    vec point;
    vec normals[NORMAL_COUNT];   // several where shading is averaged over them, each with its weight
    real weights[NORMAL_COUNT];
    vec normal;                  // the one that stands for all: shadows, reflections, channel N
    real cone;                   // the pixel's footprint there
    real smooth, residual;       // escape count; distance of the pixel's points from their plane, in footprints
    color tint;
} spot;

// The background where nothing is hit, for rays from the eye (`mirrored` 0) and for mirrored ones.
INLINE color sky(vec direction, real picture_y, int mirrored, world w) {
#if HAS_ENVIRONMENT
    if (mirrored || w.material->environment_seen) return environment_color(direction, w.material, w.environment);
#endif
    const real share = mirrored ? R(0.5) - R(0.5) * direction.z : picture_y / (real)((scalar)w.view->height);
    return color_mix(color_splat(w.material->background_top), color_splat(w.material->background_bottom),
                     clamp(share, R(0.0), R(1.0)));
}

// The normal of the surface where a march has ended, and its escape count. Both are taken where the ray's cone came near the
// solid: most of these surfaces are rougher than a pixel, and there the distance has smoothed them over the pixel's footprint.
// Where the surface is smooth its normal is the one at the hit: there both differ little for the way between them.
#define SMOOTH R(0.009)  // radians a footprint: a smooth surface turns at most so fast ...
#define ROUGH R(0.013)   // ... and one that turns faster is rough
INLINE vec surface_normal(vec wide, vec fine, const crossing *met, real cone) {
    const real way = fmax(met->last - met->touch, R(0.01) * cone);
    const vec turn = vec_scale(vec_sub(fine, wide), R(1.0) / way);
    const real share = clamp((ROUGH - sqrt(vec_dot(turn, turn)) * cone) / (ROUGH - SMOOTH), R(0.0), R(1.0));
    const vec at_hit = vec_along(fine, met->t - met->last, turn);
    return vec_normalize(vec_along(wide, share, vec_sub(at_hit, wide)));
}

#if POLISH
// A place that does not depend on how the march came there: where the distance is half the cone, by the secant method (the
// slope is that of a distance, -1, at first). Normals from the positions of points need it.
INLINE surface_point surface_polished(ray r, crossing *met, mask active, world w, clearance *there, tally *cost) {
    surface_point surface;
    const real cone = (real)(w.settings->detail) * (r.footprint + r.spread * met->t);
    const real wanted = R(0.5) * cone;
    real t = met->touch, before = t, height_before = R(0.0);
    for (int i = 0; i < TURNS(POLISH); ++i) {
        *there = orbit_dual_distance(vec_along(r.origin, t, r.direction), active, w.orbit, w.k, &surface);
        cost->count += pick(active, there->end.count, R(0.0));
        cost->steps += pick(active, R(1.0), R(0.0));
        if (i == POLISH - 1) break;
        const real height = there->step * (real)(w.settings->step_scale) - wanted;
        const real slope = (height - height_before) / (t - before);
        const mask usable = less(slope, R(0.0)) & less(R(-1e6), slope);
        const real move = i == 0 ? height : pick(usable, -height / slope, height);
        before = t;
        height_before = height;
        t += clamp(move, -cone, cone);
    }
    met->touch = pick(active, t, met->touch);
    return surface;
}
#endif

// The surface where a march has ended: its normal and its escape count. `touch` becomes the place that is shaded.
INLINE void surface_at(ray r, crossing *met, mask active, world w, vec *normal, real *smooth, tally *cost) {
    met->touch = fmin(met->touch, met->last);
    const real cone = (real)(w.settings->detail) * (r.footprint + r.spread * met->t);
    clearance there;
#if MARCH_KEEPS_SURFACE
    const surface_point surface = met->near;
    there.end.count = met->near_count;
    there.end.inside = less(R(1.0), R(0.0));
    *normal = surface_normal(vec_normalize(surface.gradient), vec_normalize(met->gradient), met, cone);
#elif POLISH
    const surface_point surface = surface_polished(r, met, active, w, &there, cost);
    *normal = vec_normalize(surface.gradient);
#else
    surface_point surface, at_hit;
    for (int i = 0; i < TURNS(2); ++i) {
        surface = at_hit;
        const real t = i == 0 ? met->touch : met->last;
        const clearance here = orbit_dual_distance(vec_along(r.origin, t, r.direction), active, w.orbit, w.k, &at_hit);
        if (i == 0) there = here;
        cost->count += pick(active, here.end.count, R(0.0));
    }
    *normal = surface_normal(vec_normalize(surface.gradient), vec_normalize(at_hit.gradient), met, cone);
#endif
    // No gradient: inside the solid already at the eye, or an extremum. Face the viewer.
    const mask flat = less(vec_dot(*normal, *normal), R(0.5)) | there.end.inside;
    *normal = vec_pick(flat, vec_scale(r.direction, R(-1.0)), *normal);
    // What is seen does not face away, but for a pixel's width past a rim. A hit on the far side of a sheet thinner than a pixel
    // does: mirrored, it stands for the near side.
    const real away = vec_dot(*normal, r.direction);
    *normal = vec_pick(less(R(0.1), away), vec_along(*normal, R(-2.0) * away, r.direction), *normal);
    *smooth = smooth_count(there.end, surface, w.orbit);
}

// Whether any normal of the spot faces that way. (With the mean normal only, a rough spot's other normals would have no shadow.)
INLINE mask faces(const spot *s, vec direction) {
    mask any_normal = less(R(1.0), R(0.0));
    for (int i = 0; i < TURNS(NORMAL_COUNT); ++i) {
        any_normal |= less(R(0.0), s->weights[i]) & less(R(0.0), vec_dot(s->normals[i], direction));
    }
    return any_normal;
}

// The light that one light ray adds, for every normal of the spot.
INLINE color lit_by(const spot *s, incidence in, mask lit, real open, vec to_viewer, __constant const struct Light *light,
                    __constant const struct Material *material) {
    color sum = color_of(R(0.0), R(0.0), R(0.0));
    for (int i = 0; i < TURNS(NORMAL_COUNT); ++i) {
        const color one = phong(s->tint, s->normals[i], to_viewer, in, lit, open, light, material);
        sum = color_add(sum, color_scale(one, s->weights[i]));
    }
    return sum;
}

#if !COLORING_PER_POINT
// The colour M of a spot where one quantity chooses it from the palette.
INLINE color surface_tint(const spot *s, vec view_direction, mask active, world w) {
    const real quantity = coloring_quantity(s->point, s->normal, view_direction, s->cone, s->smooth, s->residual, active,
                                            w.material, w.orbit, w.k);
    return surface_color(s->normal, quantity, w.material, w.palette);
}
#endif
