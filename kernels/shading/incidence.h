// The light that comes from one light to a point.
typedef struct {
    vec toward;      // direction to the light, length 1
    real distance;   // to its middle; largest number for a far one
    real strength;   // intensity after falloff
} incidence;

// From a place.
INLINE incidence light_from_place(light_record light, vec point) {
    const real bright = (real)(light->intensity);
    const vec offset = vec_sub(vec_splat(light->vector), point);
    const real square = fmax(vec_dot(offset, offset), (real)(REAL_SMALLEST));
    return (incidence){vec_normalize(offset), sqrt(square), light->inverse_square ? bright / square : bright};
}
