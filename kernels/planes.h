// Cut planes in the picture of an object: quads coloured by escape counts, composited by depth; and those that cut,
// which take away what lies in front of them and show the formula's counts on the face.
//
// PLANES of them.
typedef struct {
    __global const struct CutPlane *planes;
    __constant const struct Orbit *orbits;
    __constant const scalar *k;
    __global const float *palettes;   // PALETTE_SIZE colours for each plane
} plane_set;

// What the planes add to a picture. In front of the object: light, and the part that comes through; behind it the same.
typedef struct {
    color front, behind;
    real front_through, behind_through;
    real nearest;      // the nearest plane that is seen well, along the ray; the largest number if there is none
    vec normal, point;
    real count;
} plane_layers;

// Cuts a ray to the part that the cutting planes leave; lanes without such a part are not in the result. `face`: the plane
// at which a lane now begins, or -1.
INLINE mask planes_cut(ray *r, real *face, plane_set set) {
    *face = R(-1.0);
    for (int i = 0; i < PLANES; ++i) {
        if (!set.planes[i].cut) continue;
        const vec normal = vec_splat(set.planes[i].normal);
        const real height = vec_dot(vec_sub(r->origin, vec_splat(set.planes[i].center)), normal);
        const real climb = vec_dot(r->direction, normal);
        const real t = -height / pick(equal(climb, R(0.0)), (real)(REAL_SMALLEST), climb);
        const mask down = less(climb, R(0.0));
        const mask enters = down & less(r->near, t);
        *face = pick(enters, (real)((scalar)i), *face);
        r->near = pick(enters, t, r->near);
        r->far = pick(~down, fmin(r->far, t), r->far);
    }
    return less(r->near, r->far);
}

// Puts the planes into a shot whose radiance is still that of the object alone, not over any background.
INLINE shot planes_into(shot s, color object, color background, plane_layers layers, real time, __constant const struct View *view) {
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
