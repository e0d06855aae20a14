// Lights as paths ask for them: a direction to a place of a light, its density, and where a ray meets one.
//
// A delta light comes from one direction: its density is 0 and `light` the irradiance of a surface that faces it. Of others `light` is
// radiance, and light / density the estimate of irradiance.
#define LIGHT_PI R(3.141592653589793)

typedef struct {
    vec toward;
    real distance;
    color light;
    real density;
} light_ray;

// The directions to all places of a light: about `in.toward`, with the light's spread.
INLINE real light_cone_density(__constant const struct Light *light) {
    return R(1.0) / (R(2.0) * LIGHT_PI * (real)(light->spread));
}

INLINE light_ray light_sample(__constant const struct Light *light, vec point, real u, real v) {
    const incidence in = light_at(light, point);
    light_ray r;
    r.distance = in.distance;
    r.toward = in.toward;
    r.density = R(0.0);
    real strength = LIGHT_PI * in.strength;
    if (light->spread > S(0.0)) {
        // The cosine over a disc about the direction d adds up to pi sin^2(a/2) d.
        r.toward = cone_direction(in.toward, (real)(light->spread), u, v);
        r.density = light_cone_density(light);
        const scalar square = light->spread * (S(2.0) - light->spread);
        strength = in.strength / (real)(square);
    }
    r.light = color_scale(color_splat(light->color), strength);
    return r;
}

// Whether rays can meet it by chance: discs at infinity. A point light is as large as it should look from each place, and nowhere.
INLINE int light_is_met(__constant const struct Light *light) { return light->kind == LIGHT_DIRECTIONAL && light->spread > S(0.0); }

// Whether a ray that meets nothing else goes into it.
INLINE mask light_met(__constant const struct Light *light, vec direction) {
    if (!light_is_met(light)) return less(R(1.0), R(0.0));
    // 1 - cos, which keeps its digits: half the square of the distance between the directions.
    const vec apart = vec_sub(direction, vec_scale(vec_splat(light->vector), R(-1.0)));
    return less_equal(R(0.5) * vec_dot(apart, apart), (real)(light->spread));
}

// The radiance that a disc at infinity shows.
INLINE color light_shown(__constant const struct Light *light) {
    const scalar square = light->spread * (S(2.0) - light->spread);
    return color_scale(color_splat(light->color), (real)(light->intensity / square));
}

// About the irradiance that a light can bring to a point.
INLINE real light_weight(__constant const struct Light *light, vec point) {
    const color c = color_splat(light->color);
    return LIGHT_PI * light_at(light, point).strength * (R(0.2126) * c.r + R(0.7152) * c.g + R(0.0722) * c.b);
}
