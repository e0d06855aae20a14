// Fog between the eye and what it sees: the same everywhere, or thinner the higher it is.
#define FOG_THICKEST R(80.0)   // no exponent is larger, so that float32 holds the power

// What is left of the integral of e^-c from 0 to c, divided by c: near 0 by its series, which keeps its digits.
INLINE real fog_mean(real start, real climb) {
    const real series = R(1.0) + climb * (R(-0.5) + climb * (R(0.16666667) + climb * (R(-0.041666667) + climb * R(0.0083333333))));
    const real low = exp(fmin(-start, FOG_THICKEST)), high = exp(fmin(-start - climb, FOG_THICKEST));
    const mask level = less(fabs(climb), R(0.1));
    return pick(level, low * series, (low - high) / pick(level, R(1.0), climb));
}

INLINE real fog_level(vec a, material_record m) { return vec_dot(a, vec_splat(m->fog_up)); }

// The optical depth of a way along a ray.
INLINE real fog_depth(vec origin, vec direction, real way, material_record m) {
    const real even = (real)(m->fog_density) * way;
    if (m->fog_height <= S(0.0)) return even;
    const real share = R(1.0) / (real)(m->fog_height);
    return even * fog_mean((fog_level(origin, m) - (real)(m->fog_base)) * share, fog_level(direction, m) * way * share);
}

// The part of a light from infinitely far away that comes through.
INLINE real fog_passes_all(vec origin, vec direction, material_record m) {
    if (m->fog_height <= S(0.0)) return R(0.0);
    const real start = (fog_level(origin, m) - (real)(m->fog_base)) / (real)(m->fog_height);
    const real rise = fog_level(direction, m);
    const mask climbs = less(R(0.0), rise);
    const real column = (real)(m->fog_density * m->fog_height) * exp(fmin(-start, FOG_THICKEST));
    return pick(climbs, exp(-column / pick(climbs, rise, R(1.0))), R(0.0));
}
