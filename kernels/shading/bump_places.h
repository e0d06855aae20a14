// Places around an interaction, where the heights of its material's relief are compared.

// The part of each material in an interaction's, before blends are told apart.
INLINE real material_share(const interaction *here, int number, world w) {
    const real found = (real)((scalar)number);
    const real own = pick(equal(interaction_material(here, w), found), R(1.0), R(0.0));
    if (!any_lane(less(R(0.0), here->share))) return own;
    const real other = pick(equal(object_material(here->other, w), found), R(1.0), R(0.0));
    return own + here->share * (other - own);
}

// How far apart these places are: a pixel's footprint, so that details which a pixel cannot show are no noise, or what the material
// asks for. Below 0 where there is no relief, as on the faces of cuts.
INLINE real bump_width(const interaction *here, world w) {
    real width = (real)(w.materials->bump_width);
    const real root = interaction_material(here, w);
    for (int i = 1; i < w.settings->material_count; ++i) width = pick(equal(root, (real)((scalar)i)), (real)(w.materials[i].bump_width), width);
    // Where two flow together, as either of them has.
    for (int i = 0; i < w.settings->material_count; ++i) {
        if (!any_lane(less(R(0.0), here->share))) break;
        const mask has = less(R(0.0), material_share(here, i, w));
        width = pick(has, fmax(width, (real)(w.materials[i].bump_width)), width);
    }
    return pick(less(width, R(0.0)) | on_face(here), R(-1.0), fmax(width, here->cone));
}

// The way to one of them, length 1: they are the corners of a triangle with equal sides around the interaction.
INLINE vec bump_way(vec normal, int place) {
    vec side, up;
    make_frame(normal, &side, &up);
    if (place == 0) return side;
    return vec_along(vec_scale(side, R(-0.5)), place == 1 ? R(0.8660254037844386) : R(-0.8660254037844386), up);
}

// From the middle of a triangle to its corners, in sides.
#define BUMP_REACH R(0.5773502691896258)

// The interaction at one of them, in the plane that touches the surface at `here`.
INLINE interaction bump_interaction(const interaction *here, real width, int place) {
    interaction there = *here;
    there.point = vec_along(here->point, BUMP_REACH * width, bump_way(here->normal, place));
    there.cone = width;
    return there;
}
