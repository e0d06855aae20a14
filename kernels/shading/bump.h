// The relief of a material: the normal of the surface moved up by a height, n' ~ n - the height's gradient along the surface (Blinn 1978; as
// the surface gradient of Mikkelsen 2010). The gradient is that of the plane through the heights at three places around the interaction, which
// are a footprint apart. Of a picture the shares of its three sides are the interaction's (Mikkelsen 2020, "Surface gradient-based bump mapping
// framework").

// How high the relief of an interaction's material is at a place around it.
INLINE real height_at(stage s, const interaction *there, int place, world w) {
    // As `pbr_at` mixes the parts of blends.
    real shares[MOST_MATERIALS], height = R(0.0);
    for (int i = 0; i < w.settings->material_count; ++i) shares[i] = material_share(there, i, w);
    for (int i = 0; i < w.settings->material_count; ++i) {
        if (!any_of(shares[i])) continue;
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
}

// The slope of an interaction's relief, as the viewer's side of the surface has it.
CALLED relief relief_at(stage s, const interaction *here, world w) {
    relief found = {R(0.0), vec_of(R(0.0), R(0.0), R(0.0))};
    const real width = bump_width(here, w);
    const mask rises = less(R(0.0), width);
    if (!any_lane(rises)) return found;
    vec slope = found.slope;
    for (int place = 0; place < TURNS(BUMP_PLACES); ++place) {
        const interaction there = bump_interaction(here, width, place);
        slope = vec_along(slope, height_at(s, &there, place, w), bump_way(here->normal, place));
    }
    // The corners' ways add up to 0, and their squares to 3/2 in each direction.
    found.slope = vec_scale(slope, R(1.0) / (R(1.5) * BUMP_REACH * width));
    found.rises = number_of(rises);
    return found;
}
