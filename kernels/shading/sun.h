// The sun of a sky: a disc before the map, since a pixel of the map is as wide as a third of it. Where the air leaves less of its light
// below than above, and towards its limb, it is darker (see clfractal/scene/sun.py). Behind the map's pixels stand
//   toward[3]      its middle, in the map's own directions,
//   light[3]       radiance at its middle, linear Rec. 709,
//   fade[3]        how the logarithm of that rises with height, in radii of the disc,
//   bend[3]        and how that rise does,
//   limb[3]        exponents of the cosine under which its surface is seen,
//   horizon        z of directions below which the ground hides it,
//   spread         1 - cos of its radius,
//   share          the part of directions that are chosen in it.
INLINE __global const float *sun_numbers(material_record m, __global const float *map) {
    const int rows = m->environment_rows, columns = m->environment_columns;
    return map + 2 * (rows + 1) + rows * (2 * columns + 1) + 3 * m->environment_width * m->environment_height;
}

INLINE real sun_spread(__global const float *sun) { return (real)((scalar)sun[16]); }
INLINE real sun_share(__global const float *sun) { return (real)((scalar)sun[17]); }

// The direction to its middle.
INLINE vec sun_toward(material_record m, __global const float *sun) {
    const scalar c = m->environment_turn[0], s = m->environment_turn[1], x = (scalar)sun[0], y = (scalar)sun[1];
    return vec_of((real)(c * x - s * y), (real)(s * x + c * y), (real)((scalar)sun[2]));
}

// The square of a direction's distance from the middle, in radii of the disc: by chords, since the cosine of so small an angle has lost
// its digits.
INLINE real sun_square(vec direction, material_record m, __global const float *sun) {
    const vec apart = vec_sub(direction, sun_toward(m, sun));
    return vec_dot(apart, apart) / (R(2.0) * sun_spread(sun));
}

// The radiance that a direction shows of it.
INLINE color sun_light(vec direction, material_record m, __global const float *sun) {
    const real square = sun_square(direction, m, sun);
    const mask met = less(square, R(1.0)) & less((real)((scalar)sun[15]), direction.z);
    color found = color_of(R(0.0), R(0.0), R(0.0));
    if (!any_lane(met)) return found;
    // Lanes beside it would overflow.
    const real rest = pick(met, fmax(R(1.0) - square, R(1e-6)), R(1.0)), cosine = R(0.5) * log(rest);
    const real height = pick(met, (direction.z - (real)((scalar)sun[2])) / sqrt(R(2.0) * sun_spread(sun)), R(0.0));
#define SUN_OF(i) \
    (real)((scalar)sun[3 + i]) * exp((real)((scalar)sun[12 + i]) * cosine + height * ((real)((scalar)sun[6 + i]) + height * (real)((scalar)sun[9 + i])))
    found = color_pick(met, color_of(SUN_OF(0), SUN_OF(1), SUN_OF(2)), found);
#undef SUN_OF
    return found;
}

// Per steradian, with which a direction is chosen in it.
INLINE real sun_density(vec direction, material_record m, __global const float *sun) {
    const real inside = sun_share(sun) / (R(6.283185307179586) * sun_spread(sun));
    return pick(less(sun_square(direction, m, sun), R(1.0)), inside, R(0.0));
}
