// The light that comes from one light to a point.
typedef struct {
    vec toward;      // direction to the light, length 1
    real distance;   // to its middle; largest number for a far one
    real strength;   // intensity after falloff
} incidence;

// From a place, with a strength of 1; and the square of the distance.
INLINE incidence incidence_from(vec place, vec point, real *square) {
    const vec offset = vec_sub(place, point);
    *square = fmax(vec_dot(offset, offset), (real)(REAL_SMALLEST));
    return (incidence){vec_normalize(offset), sqrt(*square), R(1.0)};
}

INLINE incidence light_from_place(light_record light, vec point) {
    const real bright = (real)(light->intensity);
    real square;
    incidence in = incidence_from(vec_splat(light->vector), point, &square);
    in.strength = light->inverse_square ? bright / square : bright;
    return in;
}
