// Tables of what layers of a material reflect in all; `clfractal/shading/scattering.py` fills them and tells their layout.
#include "device/gather.h"

#define SMOOTHEST (R(1.0) / (real)((scalar)SMOOTHEST_PARTS))            // alpha, at the least
#define SMOOTHEST_FUZZ (R(1.0) / (real)((scalar)SMOOTHEST_FUZZ_PARTS))
#define ALBEDO_ROW (ALBEDO_COSINES + 1)
#define ALBEDO_TABLE (ALBEDO_ROUGHNESSES * ALBEDO_ROW)
#define REPEATED_TABLES 4   // of metals, see `docs/tables_facets.py`
#define ALBEDO_FUZZ (REPEATED_TABLES * ALBEDO_TABLE)
#define ALBEDO_DIELECTRIC (ALBEDO_FUZZ + ALBEDO_TABLE)
// How much light visible facets reflect at most, and the mean and the spread of its cosine with them; colours of wavenumbers.
// Their numbers are those of `docs/tables_spectrum.py`.
#define WAVE_COUNT 48
#define WAVE_SHORTEST_NM 380
#define WAVE_LONGEST_NM 720
#define WAVE_COLORS (ALBEDO_ALL - 3 * WAVE_COUNT)
#define FACETS_MET (WAVE_COLORS - 3 * ALBEDO_TABLE)
// With glass (`docs/tables_glass.py`): rough glass, seen from outside and from inside; wavelengths.
#define ALBEDO_GLASS ALBEDO_ALL   // behind all others
#define ALBEDO_GLASS_INSIDE (ALBEDO_GLASS + ALBEDO_REFLECTANCES * ALBEDO_TABLE)
#define SPECTRUM (ALBEDO_GLASS_INSIDE + ALBEDO_REFLECTANCES * ALBEDO_TABLE)

// Of one direction, whose cosine with the normal is given, and of the mean over all directions.
typedef struct {
    real of_direction, mean;
} albedo;

// Where a direction's cosine and a roughness lie in every table of roughnesses: the entry before, the head of its row, and the shares of
// those behind. All lanes look up at a time.
typedef struct {
    ints entry, row;
    real across, down;
} albedo_place;

INLINE albedo_place albedo_place_of(real cosine, real roughness) {
    const real x = sqrt(clamp(cosine, R(0.0), R(1.0))) * (real)((scalar)(ALBEDO_COSINES - 1));
    const real y = clamp(roughness, R(0.0), R(1.0)) * (real)((scalar)(ALBEDO_ROUGHNESSES - 1));
    const real i = floor(least(x, (real)((scalar)(ALBEDO_COSINES - 2)))), k = floor(least(y, (real)((scalar)(ALBEDO_ROUGHNESSES - 2))));
    const ints row = to_ints(k * (real)((scalar)ALBEDO_ROW));
    return (albedo_place){row + to_ints(i), row, x - i, y - k};
}

// From a table of roughnesses, or from the one that begins so many numbers behind it in each lane.
INLINE albedo albedo_there(__global const float *table, ints behind, albedo_place at) {
    __global const float *next = table + ALBEDO_ROW, *means = table + ALBEDO_COSINES;
    const ints entry = at.entry + behind, row = at.row + behind;
    const real low = mix(gather_floats(table, entry), gather_floats(table + 1, entry), at.across);
    const real high = mix(gather_floats(next, entry), gather_floats(next + 1, entry), at.across);
    return (albedo){mix(low, high, at.down), mix(gather_floats(means, row), gather_floats(means + ALBEDO_ROW, row), at.down)};
}

INLINE albedo albedo_at(__global const float *table, real cosine, real roughness) {
    return albedo_there(table, (ints)(0), albedo_place_of(cosine, roughness));
}

// From tables for square roots of the reflectance at normal incidence, the first of which is given.
INLINE albedo albedo_of_root(__global const float *tables, real cosine, real roughness, real root) {
    real rest = clamp(root * (real)((scalar)ALBEDO_REFLECTANCES), R(0.0), (real)((scalar)ALBEDO_REFLECTANCES - S(1.001)));
    const real step = floor(rest);
    rest -= step;
    const ints behind = to_ints(step * (real)((scalar)ALBEDO_TABLE));
    const albedo_place at = albedo_place_of(cosine, roughness);
    const albedo low = albedo_there(tables, behind, at), high = albedo_there(tables + ALBEDO_TABLE, behind, at);
    return (albedo){low.of_direction + rest * (high.of_direction - low.of_direction), low.mean + rest * (high.mean - low.mean)};
}

// Of a dielectric's boundary.
INLINE albedo albedo_of_dielectric(__global const float *tables, real cosine, real roughness, real root) {
    return albedo_of_root(tables + ALBEDO_DIELECTRIC, cosine, roughness, root);
}

// What a metal's facets do to light from or to a direction that meets several of them: the scale of the lobe of two, and of that of more;
// and by which powers of cosines the first facet reflects; in all directions those between the first and the last.
typedef struct {
    real twice, more, first[2], between[2];
} repeated;

INLINE repeated repeated_at(__global const float *tables, real cosine, real roughness) {
    albedo found[REPEATED_TABLES];
    for (int i = 0; i < REPEATED_TABLES; ++i) found[i] = albedo_at(tables + i * ALBEDO_TABLE, cosine, roughness);
    return (repeated){found[0].of_direction, found[1].of_direction, {found[2].of_direction, found[3].of_direction},
                        {found[2].mean, found[3].mean}};
}
