// Colours of a plane by escape counts: a palette over count / limit, and a colour for the inside.
enum { CURVE_LINEAR, CURVE_ROOT, CURVE_LOG };

INLINE color escape_color(escaped e, plane_record colors, __global const float *palette) {
    real quantity;
    if (colors->curve == CURVE_LOG) {
        quantity = log(fmax(e.count, R(1.0))) * (real)(colors->inverse_limit);
    } else {
        quantity = e.count * (real)(colors->inverse_limit);
        if (colors->curve == CURVE_ROOT) quantity = sqrt(fmax(quantity, R(0.0)));
    }
    const real place = place_in_palette(quantity, colors->scale, colors->offset, colors->repeat);
    return color_pick(e.inside, color_splat(colors->inside), palette_color(place, colors->repeat, palette));
}
