// Facets that are drawn out along a tangent, and what they reflect in all.
#include "shading/bsdf.h"

// Highlights that are drawn out along a tangent have it as a side of their frame; where it is along the normal, any other. Widths by
// OpenPBR 1.1 ("Microfacet model"): (1 - anisotropy) times as wide across it, at the same sum of squares.
INLINE void specular_draws_out(bsdf *b, const pbr *p, vec normal) {
    if (!any_of(p->specular_anisotropy)) return;
    const mask drawn = less(R(0.0), p->specular_anisotropy);
    const real rest = R(1.0) - p->specular_anisotropy, along = b->facets.alpha * sqrt(R(2.0) / (R(1.0) + rest * rest));
    const real across = fmax(rest * along, SMOOTHEST);
    const slopes uneven = {sqrt(along * across), along / across - R(1.0), across / along - R(1.0)};
    b->facets = slopes_pick(drawn, uneven, b->facets);
    const vec tangent = vec_normalize(p->specular_tangent), side = vec_along(tangent, -vec_dot(tangent, normal), normal);
    const mask lies = drawn & less(R(1e-8), vec_dot(side, side));
    b->side = vec_pick(lies, vec_normalize(side), b->side);
    b->up = vec_pick(lies, vec_cross(normal, b->side), b->up);
}

// Tables of factors, 1 for facets that are even: on the lobe of what metals reflect more than once; on what glass lets through and mirrors,
// from outside and from within; and on what dielectrics mirror, by the root of their reflectance, from 0.2 in steps of 0.3. Axes: roughness,
// anisotropy, the part of a level direction that is along the tangent, the root of its cosine with the normal; the last number of a row is
// that of the mean over all directions (`clfractal/shading/scattering.py`).
#define DRAWN_COSINES 16
#define DRAWN_TURNS 6
#define DRAWN_STEPS 7
#define DRAWN_ROOTS 3
#define DRAWN_ROW (DRAWN_COSINES + 1)
#define DRAWN_TABLE (ALBEDO_ROUGHNESSES * DRAWN_STEPS * DRAWN_TURNS * DRAWN_ROW)
#define DRAWN_OUT (ALBEDO_DIELECTRIC + ALBEDO_REFLECTANCES * ALBEDO_TABLE)
// Where `at` is between two of `count` numbers.
#define DRAWN_CELL(at, count) min((int)(at), (count) - 2)

// `table`: which one, or between which two.
INLINE albedo drawn_factor(__global const float *tables, real table, slopes facets, real rough, vec from) {
    scalar tables_at[LANES], rows[LANES], steps[LANES], turns[LANES], columns[LANES], found[LANES], means[LANES];
    lanes_store(table, tables_at);
    lanes_store(clamp(rough, R(0.0), R(1.0)) * (real)((scalar)(ALBEDO_ROUGHNESSES - 1)), rows);
    lanes_store(clamp(-facets.across, R(0.0), R(1.0)) * (real)((scalar)(DRAWN_STEPS - 1)), steps);
    const real level = sqrt(fmax(from.x * from.x + from.y * from.y, R(1e-12)));
    lanes_store(fmin(fabs(from.x) / level, R(1.0)) * (real)((scalar)(DRAWN_TURNS - 1)), turns);
    lanes_store(sqrt(clamp(from.z, R(0.0), R(1.0))) * (real)((scalar)(DRAWN_COSINES - 1)), columns);
    for (int lane = 0; lane < LANES; ++lane) {
        const int t = DRAWN_CELL(tables_at[lane], DRAWN_ROOTS + 3), k = DRAWN_CELL(rows[lane], ALBEDO_ROUGHNESSES);
        const int a = DRAWN_CELL(steps[lane], DRAWN_STEPS), n = DRAWN_CELL(turns[lane], DRAWN_TURNS);
        const int i = DRAWN_CELL(columns[lane], DRAWN_COSINES);
        const int first = ((t * ALBEDO_ROUGHNESSES + k) * DRAWN_STEPS + a) * DRAWN_TURNS + n;
        found[lane] = means[lane] = S(0.0);
        // Unrolled, all that is known of the material would wait in memory (GPUs).
        #pragma unroll 1
        for (int corner = 0; corner < 16; ++corner) {
            const int one = corner & 1, two = corner >> 1 & 1, three = corner >> 2 & 1, four = corner >> 3;
            const scalar weight = (one ? turns[lane] - (scalar)n : (scalar)(n + 1) - turns[lane])
                                  * (two ? steps[lane] - (scalar)a : (scalar)(a + 1) - steps[lane])
                                  * (three ? rows[lane] - (scalar)k : (scalar)(k + 1) - rows[lane])
                                  * (four ? tables_at[lane] - (scalar)t : (scalar)(t + 1) - tables_at[lane]);
            const int place = first + one + DRAWN_TURNS * (two + DRAWN_STEPS * (three + ALBEDO_ROUGHNESSES * four));
            __global const float *row = tables + DRAWN_OUT + place * DRAWN_ROW;
            found[lane] += weight * mix((scalar)row[i], (scalar)row[i + 1], columns[lane] - (scalar)i);
            means[lane] += weight * (scalar)row[DRAWN_COSINES];
        }
    }
    return (albedo){lanes_load(found), lanes_load(means)};
}

INLINE albedo specular_drawn(albedo even, real table, slopes facets, real rough, vec from, __global const float *tables) {
    if (!any_of(facets.along)) return even;
    const albedo factor = drawn_factor(tables, fmin(table, R(3.0) + (real)((scalar)(DRAWN_ROOTS - 1))), facets, rough, from);
    const mask drawn = less(R(0.0), facets.along);
    return (albedo){pick(drawn, fmin(even.of_direction * factor.of_direction, R(1.0)), even.of_direction),
                    pick(drawn, fmin(even.mean * factor.mean, R(1.0)), even.mean)};
}

INLINE repeated specular_drawn_again(repeated even, slopes facets, real rough, vec from, __global const float *tables) {
    if (!any_of(facets.along)) return even;
    const real factor = drawn_factor(tables, R(0.0), facets, rough, from).of_direction;
    const mask drawn = less(R(0.0), facets.along);
    even.twice = pick(drawn, even.twice * factor, even.twice);
    even.more = pick(drawn, even.more * factor, even.more);
    return even;
}
