// Light from all directions, infinitely far away: a picture with one row for each latitude and one column for each longitude,
// and tables to choose directions by its brightness (Pharr, Jakob, Humphreys, Physically Based Rendering, 3rd ed., 14.2.4).
//
// z is up. The top row looks at +z, the middle of the picture at +y, its right quarter at +x, its sides at -y: OpenEXR's
// convention for latitude-longitude maps (ImfEnvmap.h), where y is up, z is ahead and x is to the left.
//
// Directions have length 1. The material's fields tell the sizes and the turn about z; the map is one buffer of floats:
//   edges[rows + 1]              z of the borders of the tables' rows, from 1 down to -1,
//   by_row[rows + 1]             cumulative probability of the rows, 0 to 1,
//   by_column[rows][columns + 1] the same along each row,
//   density[rows][columns]       probability per steradian, constant in a cell,
//   pixels[height][width][3]     linear Rec. 709.
// clfractal/shading/environment.py fills it. Needs lanes.h, numbers/real.h, vectors.h, structs.h, shade.h; sampling.h.
#define ENVIRONMENT_TURN S(6.283185307179586)
#include "shading/sun.h"

// Whether there is one, and whether it has a sun before it.
INLINE int has_environment(material_record m) { return m->environment_width > 0; }
INLINE int has_sun(material_record m) { return m->environment_sun; }

// Where in the picture a direction lies: parts of its width and height, both 0 to 1.
INLINE void environment_place(vec direction, material_record m, real *across, real *below) {
    const real c = (real)(m->environment_turn[0]), s = (real)(m->environment_turn[1]);
    const real x = c * direction.x + s * direction.y, y = c * direction.y - s * direction.x;
    *across = R(0.5) + real_atan2(x, y) / (real)(ENVIRONMENT_TURN);
    *below = R(0.5) - real_atan2(direction.z, sqrt(x * x + y * y)) / (real)(S(0.5) * ENVIRONMENT_TURN);
}

// The light that comes from a direction: pixels blended linearly, around the sides too; above the middle of the top row and
// below the middle of the last row they are constant.
CALLED color environment_color(vec direction, material_record m, __global const float *map) {
    const int width = m->environment_width, height = m->environment_height;
    const int rows = m->environment_rows, columns = m->environment_columns;
    __global const float *pixels = map + 2 * (rows + 1) + rows * (2 * columns + 1);
    real across, below;
    environment_place(direction, m, &across, &below);
    // fmax and fmin turn what is not a number into one: converting it to a whole number would be undefined.
    across = fmin(fmax(across * (real)((scalar)width) - R(0.5), R(-0.5)), (real)((scalar)width - S(0.5)));
    below = fmin(fmax(below * (real)((scalar)height) - R(0.5), R(0.0)), (real)((scalar)(height - 1)));
    scalar x[LANES], y[LANES], mixed[3][LANES];
    lanes_store(across, x);
    lanes_store(below, y);
    for (int lane = 0; lane < LANES; ++lane) {
        const int column = (int)floor(x[lane]), row = (int)y[lane];
        const float right = (float)(x[lane] - (scalar)column), low = (float)(y[lane] - (scalar)row);
        const int first = column < 0 ? width - 1 : column, second = first + 1 == width ? 0 : first + 1;
        __global const float *upper = pixels + 3 * width * row;
        __global const float *lower = row + 1 < height ? upper + 3 * width : upper;
        for (int i = 0; i < 3; ++i, ++upper, ++lower) {
            const float above = mix(upper[3 * first], upper[3 * second], right), under = mix(lower[3 * first], lower[3 * second], right);
            mixed[i][lane] = mix(above, under, low);
        }
    }
    const real intensity = (real)(m->environment_intensity);
    color found = color_of(lanes_load(mixed[0]), lanes_load(mixed[1]), lanes_load(mixed[2]));
    if (has_sun(m)) found = color_add(found, sun_light(direction, m, sun_numbers(m, map)));
    return color_scale(found, intensity);
}

// The last of `count` entries that is not above u; the next one is, so that cells without probability are never chosen.
INLINE int environment_find(__global const float *cumulative, int count, scalar u) {
    int first = 0;
    for (int left = count; left > 1;) {
        const int middle = left >> 1;
        if ((scalar)cumulative[first + middle] <= u) first += middle;
        left -= middle;
    }
    return first;
}

// A direction chosen by the map's brightness from two numbers in [0, 1), and its probability per steradian, which is above 0.
INLINE vec map_sample(real u, real v, material_record m, __global const float *map, real *density) {
    const int rows = m->environment_rows, columns = m->environment_columns;
    __global const float *by_row = map + rows + 1, *by_column = by_row + rows + 1;
    __global const float *densities = by_column + rows * (columns + 1);
    const real below_one = R(1.0) - R(0.5) * (real)(REAL_EPSILON);
    scalar across[LANES], down[LANES], z[LANES], chosen[LANES];
    lanes_store(fmin(fmax(u, R(0.0)), below_one), across);
    lanes_store(fmin(fmax(v, R(0.0)), below_one), down);
    for (int lane = 0; lane < LANES; ++lane) {
        const int row = environment_find(by_row, rows, down[lane]);
        const scalar above = (scalar)by_row[row], part = (down[lane] - above) / ((scalar)by_row[row + 1] - above);
        // Uniform in z is uniform in area (Archimedes).
        z[lane] = mix((scalar)map[row], (scalar)map[row + 1], part);
        __global const float *cells = by_column + row * (columns + 1);
        const int column = environment_find(cells, columns, across[lane]);
        const scalar before = (scalar)cells[column];
        across[lane] = ((scalar)column + (across[lane] - before) / ((scalar)cells[column + 1] - before)) / (scalar)columns;
        chosen[lane] = (scalar)densities[row * columns + column];
    }
    *density = lanes_load(chosen);
    const real height = lanes_load(z), angle = (lanes_load(across) - R(0.5)) * (real)(ENVIRONMENT_TURN);
    const real level = sqrt(fmax((R(1.0) - height) * (R(1.0) + height), R(0.0)));
    const real x = level * sin(angle), y = level * cos(angle);
    const real c = (real)(m->environment_turn[0]), s = (real)(m->environment_turn[1]);
    return vec_of(c * x - s * y, s * x + c * y, height);
}

// Probability per steradian with which `map_sample` chooses a direction; 0 only where no light comes from.
INLINE real map_density(vec direction, material_record m, __global const float *map) {
    const int rows = m->environment_rows, columns = m->environment_columns;
    __global const float *densities = map + 2 * (rows + 1) + rows * (columns + 1);
    real across, below;
    environment_place(direction, m, &across, &below);
    scalar x[LANES], y[LANES], found[LANES];
    lanes_store(fmin(fmax(across, R(0.0)), R(1.0)) * (real)((scalar)columns), x);
    lanes_store(fmin(fmax(below, R(0.0)), R(1.0)) * (real)((scalar)rows), y);
    for (int lane = 0; lane < LANES; ++lane)
        found[lane] = (scalar)densities[min((int)y[lane], rows - 1) * columns + min((int)x[lane], columns - 1)];
    return lanes_load(found);
}

// The same of a map with a sun before it: its disc or the map, and the probability by both ways together.
INLINE vec sun_or_map_sample(real u, real v, material_record m, __global const float *map, real *density) {
    __global const float *sun = sun_numbers(m, map);
    const real share = sun_share(sun), rest = R(1.0) - share;
    const mask of_sun = less(v, share);
    const real place = pick(of_sun, v / fmax(share, (real)(REAL_SMALLEST)), (v - share) / rest);
    real by_map;
    const vec in_map = map_sample(u, place, m, map, &by_map);
    const vec in_sun = cone_direction(sun_toward(m, sun), sun_spread(sun), u, place);
    const vec found = vec_pick(of_sun, in_sun, in_map);
    by_map = pick(of_sun, map_density(in_sun, m, map), by_map);
    *density = rest * by_map + pick(of_sun, share / (ENVIRONMENT_TURN * sun_spread(sun)), sun_density(in_map, m, sun));
    return found;
}

// A direction chosen by the environment's brightness, and its probability per steradian.
INLINE vec environment_sample(real u, real v, material_record m, __global const float *map, real *density) {
    if (has_sun(m)) return sun_or_map_sample(u, v, m, map, density);
    return map_sample(u, v, m, map, density);
}

INLINE real environment_density(vec direction, material_record m, __global const float *map) {
    const real of_map = map_density(direction, m, map);
    if (!has_sun(m)) return of_map;
    __global const float *sun = sun_numbers(m, map);
    return (R(1.0) - sun_share(sun)) * of_map + sun_density(direction, m, sun);
}
