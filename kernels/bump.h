// The relief of a material: the normal of the surface moved up by a height, n' ~ n - the height's gradient along the surface (Blinn 1978; as
// the surface gradient of Mikkelsen 2010). The gradient is that of the plane through the heights at three places around the spot, which are
// a footprint apart. Of a picture the shares of its three sides are the spot's (Mikkelsen 2020, "Surface gradient-based bump mapping framework").

// How high the relief of a spot's material is at a place around it.
INLINE real height_at(stage s, const spot *there, int place, world w) {
#if MATERIALS == 1
    return map_at(s, there, place, w.maps + w.materials->bump, w).r;
#else
    // As `pbr_at` mixes the parts of blends.
    real shares[MATERIALS], height = R(0.0);
    for (int i = 0; i < MATERIALS; ++i) shares[i] = material_share(there, i, w);
    for (int i = 0; i < MATERIALS; ++i) {
        if (!any_lane(less(R(0.0), shares[i]))) continue;
        __constant const struct Pbr *material = w.materials + i;
        const int blends = material->blend[0] >= 0;
        const real found = map_at(s, there, place, w.maps + (blends ? material->mask : material->bump), w).r;
        if (blends) {
            shares[material->blend[0]] += shares[i] * (R(1.0) - found);
            shares[material->blend[1]] += shares[i] * found;
        } else {
            height += shares[i] * found;
        }
    }
    return height;
#endif
}

// Of the way that a surface faces the viewer, what is left at least by slopes that turn it from him.
#define LEAST_FACING R(0.1)

// The normal of a spot's relief, length 1; `inside`: where the viewer, and so the spot's normal, is in the set. Slopes that would turn
// the surface away from the viewer are lowered until it faces him.
CALLED void bumped_normal(stage s, const spot *here, const mask *inside, const vec *to_viewer, vec *normal, world w) {
    *normal = here->normal;
    const real width = bump_width(here, w);
    const mask rises = less(R(0.0), width);
    if (!any_lane(rises)) return;
    vec slope = vec_of(R(0.0), R(0.0), R(0.0));
    for (int place = 0; place < TURNS(BUMP_PLACES); ++place) {
        const spot there = bump_spot(here, width, place);
        slope = vec_along(slope, height_at(s, &there, place, w), bump_way(here->normal, place));
    }
    // The corners' ways add up to 0, and their squares to 3/2 in each direction.
    slope = vec_scale(slope, pick(*inside, R(-1.0), R(1.0)) / (R(1.5) * BUMP_REACH * width));
    const real facing = vec_dot(here->normal, *to_viewer), turned = vec_dot(slope, *to_viewer);
    const real most_turned = (R(1.0) - LEAST_FACING) * fmax(facing, R(0.0));
    slope = vec_scale(slope, pick(less(most_turned, turned), most_turned / turned, R(1.0)));
    const vec leaning = vec_normalize(vec_sub(here->normal, slope));
    const mask usable = rises & less(R(0.0), facing) & less(R(0.5), vec_dot(leaning, leaning));
    *normal = vec_pick(usable, leaning, here->normal);
}
