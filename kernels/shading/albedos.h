// Tables of what layers of a material reflect in all; `clfractal/shading/scattering.py` fills them and tells their layout.
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

// From a table of roughnesses.
INLINE albedo albedo_at(__global const float *table, real cosine, real roughness) {
    scalar x[LANES], y[LANES], found[LANES], means[LANES];
    lanes_store(sqrt(clamp(cosine, R(0.0), R(1.0))) * (real)((scalar)(ALBEDO_COSINES - 1)), x);
    lanes_store(clamp(roughness, R(0.0), R(1.0)) * (real)((scalar)(ALBEDO_ROUGHNESSES - 1)), y);
    for (int lane = 0; lane < LANES; ++lane) {
        const int i = min((int)x[lane], ALBEDO_COSINES - 2), k = min((int)y[lane], ALBEDO_ROUGHNESSES - 2);
        const scalar across = x[lane] - (scalar)i, down = y[lane] - (scalar)k;
        __global const float *low = table + k * ALBEDO_ROW, *high = low + ALBEDO_ROW;
        found[lane] = mix(mix((scalar)low[i], (scalar)low[i + 1], across), mix((scalar)high[i], (scalar)high[i + 1], across), down);
        means[lane] = mix((scalar)low[ALBEDO_COSINES], (scalar)high[ALBEDO_COSINES], down);
    }
    return (albedo){lanes_load(found), lanes_load(means)};
}

// From tables for square roots of the reflectance at normal incidence, the first of which is given.
INLINE albedo albedo_of_root(__global const float *tables, real cosine, real roughness, real root) {
    scalar at[LANES];
    albedo low, high;
    real rest = clamp(root * (real)((scalar)ALBEDO_REFLECTANCES), R(0.0), (real)((scalar)ALBEDO_REFLECTANCES - S(1.001)));
    const real step = floor(rest);
    rest -= step;
    // The same table for all lanes: those of another one are looked up again.
    lanes_store(step, at);
    albedo sum = {R(0.0), R(0.0)};
    mask open = less(R(-1.0), step);
    for (int lane = 0; lane < LANES; ++lane) {
        if (!any_lane(open)) break;
        const mask here = open & equal(step, (real)(at[lane]));
        if (!any_lane(here)) continue;
        open &= ~here;
        __global const float *table = tables + (int)at[lane] * ALBEDO_TABLE;
        low = albedo_at(table, cosine, roughness);
        high = albedo_at(table + ALBEDO_TABLE, cosine, roughness);
        sum.of_direction = pick(here, low.of_direction + rest * (high.of_direction - low.of_direction), sum.of_direction);
        sum.mean = pick(here, low.mean + rest * (high.mean - low.mean), sum.mean);
    }
    return sum;
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
