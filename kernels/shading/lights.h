// Lights as paths sample them: a direction to a place of a light, its density, and where a ray meets one.
//
// A delta light comes from one direction: its density is 0 and `light` the irradiance of a surface that faces it. Of others `light` is
// radiance, and light / density the estimate of irradiance.

typedef struct {
    vec toward;
    real distance;
    color light;
    real density;
} light_ray;

INLINE light_ray light_sample(light_record light, vec point, real u, real v, __global const float *tables) {
    const incidence in = light_at(light, point, tables);
    light_ray r;
    r.distance = in.distance;
    r.toward = in.toward;
    r.density = R(0.0);
    if (light->seen) {
        r.toward = light_direction(light, point, in.toward, u, v);
        const mask met = light_met_at(light, point, r.toward, &r.distance) | less(R(0.0), in.strength);
        r.density = light_density(light, point, r.toward);
        r.light = color_scale(color_splat(light->color), pick(met & less(R(0.0), in.strength), (real)(light->intensity), R(0.0)));
        return r;
    }
    real strength = LIGHT_PI * in.strength;
    if (light->spread > S(0.0)) {
        // The cosine over a disc about the direction d adds up to pi sin^2(a/2) d.
        r.toward = cone_direction(in.toward, (real)(light->spread), u, v);
        r.density = light_density(light, point, r.toward);
        const scalar square = light->spread * (S(2.0) - light->spread);
        strength = in.strength / (real)(square);
    }
    r.light = color_scale(color_splat(light->color), strength);
    return r;
}

// Whether rays can meet it by chance: discs at infinity. A point light is as large as it should look from each place, and nowhere.
INLINE int light_is_met(light_record light) { return light->far && light->spread > S(0.0); }

// Whether a ray that meets nothing else goes into it.
INLINE mask light_met(light_record light, vec direction) {
    if (!light_is_met(light)) return less(R(1.0), R(0.0));
    // 1 - cos, which keeps its digits: half the square of the distance between the directions.
    const vec apart = vec_sub(direction, vec_scale(vec_splat(light->vector), R(-1.0)));
    return less_equal(R(0.5) * vec_dot(apart, apart), (real)(light->spread));
}

// The radiance that a disc at infinity shows.
INLINE color light_shown(light_record light) {
    const scalar square = light->spread * (S(2.0) - light->spread);
    return color_scale(color_splat(light->color), (real)(light->intensity / square));
}

// Of what two ways could have found the part that one keeps: the power heuristic.
INLINE real power_share(real own, real other) {
    const real square = own * own;
    return square / fmax(square + other * other, (real)(REAL_SMALLEST));
}

#define NEVER_BENT R(-1.0)   // of one to which no chain through glass leads

// A light that was sampled: the ray to it, and the probability of having chosen it.
typedef struct {
    light_ray ray;
    real share;            // of all lights, that this one is chosen
    real reckoned;         // a factor on the density with which both ways to find it reckon
    mask both, unblocked;  // whether a path meets it by chance, too; whether nothing can be in its way
    real sought;           // of one whose light has to be looked up: 1 + the number of that thing; its own `light` is 1, and `far` unknown; or `NEVER_BENT`
} sampled_light;

// What is chosen of lights that have no records: the numbers of such choices.
#define LIGHT_OF_OBJECT(i) (real)((scalar)(-2 - (i)))
#define LIGHT_OF_ENVIRONMENT R(-1000.0)
#define LIGHT_OF_SET R(-2000.0)

// Numbers in (0, 1): two for the place on a light, one for the light, two for the one of those on the set.
#define LIGHT_SAMPLE_NUMBERS 5

// How one of all lights is chosen by what it can bring to `from`: they lie in a row, each as long as its weight, and `place` is on one of them.
typedef struct {
    vec point, from, normal;    // small lights are seen from `point`; no normal within a medium
    real own;                   // the object whose surface it is, or 0: no object lights itself
    real total, place, before;  // all weights; where the choice lies; the weights so far
    mask open;                  // whether none is chosen so far
    real number, weight;        // of a light with a record: which one, or -1
    sampled_light found;
    vec begin;                  // where the ray to it begins
} choosing;

// Whether the light with that weight is the one.
INLINE mask is_chosen(choosing *c, real weight) {
    const mask here = c->open & less(c->place, c->before + weight) & less(R(0.0), weight);
    c->before += weight;
    c->open &= ~here;
    return here;
}

INLINE void takes(choosing *c, mask here, light_ray r, real weight) {
    c->found.ray.toward = vec_pick(here, r.toward, c->found.ray.toward);
    c->found.ray.distance = pick(here, r.distance, c->found.ray.distance);
    c->found.ray.light = color_pick(here, r.light, c->found.ray.light);
    c->found.ray.density = pick(here, r.density, c->found.ray.density);
    c->found.share = pick(here, weight / c->total, c->found.share);
}
