// Colours of a plane by escape counts: a palette over count / limit, and a colour for the inside.
#define CURVE_LINEAR 0
#define CURVE_ROOT 1
#define CURVE_LOG 2

// (For planes in another renderer's picture, the colours are stored with the planes.)
#ifndef ESCAPE_COLORS
#define ESCAPE_COLORS __constant const struct EscapeColors
#endif

INLINE color escape_color(escaped e, ESCAPE_COLORS *colors, __global const float *palette) {
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
