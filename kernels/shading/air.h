// Light that fog scatters towards the eye: for each light and sample one place of the ray, and from there a ray to the light. Where
// the set is in the way, the fog is dark: shafts of light stand between the shadows.

// The fog's density at a distance along a ray.
INLINE real fog_density_at(vec origin, vec direction, real t, material_record m) {
    if (m->fog_height <= S(0.0)) return (real)(m->fog_density);
    const real level = fog_level(origin, m) + t * fog_level(direction, m) - (real)(m->fog_base);
    return (real)(m->fog_density) * exp(fmin(-level / (real)(m->fog_height), FOG_THICKEST));
}

// How far along a ray the optical depth is reached.
INLINE real fog_way(vec origin, vec direction, real depth, material_record m) {
    const real even = depth / fog_density_at(origin, direction, R(0.0), m);
    if (m->fog_height <= S(0.0)) return even;
    const real bend = fog_level(direction, m) / (real)(m->fog_height), c = even * bend;
    const mask level = less(fabs(c), R(0.03));
    const real curved = -log(fmax(R(1.0) - c, R(1e-30))) / pick(level, R(1.0), bend);
    return pick(level, even * (R(1.0) + c * (R(0.5) + c * (R(0.33333333) + c * R(0.25)))), curved);
}

// A place that scatters light, the ray from there to the light, and which part of its light comes to the eye.
typedef struct {
    real t;
    incidence in;
    real share;
} scattering;

// The place of a light's sample on the way of a ray of length `far`: by what comes through where the light is as strong everywhere, and
// by the angle at a light (Kulla and Fajardo 2012). `weight`: density of fog times what comes through, over the probability of the place.
INLINE real scattering_place(ray r, real far, real u, light_record light, material_record m, real *weight) {
    if (!light->seen && !light->inverse_square) {
        const real depth = pick(less(far, R(1e30)), fog_depth(r.origin, r.direction, fmin(far, R(1e30)), m),
                                -log(fmax(fog_passes_all(r.origin, r.direction, m), R(1e-30))));
        *weight = R(1.0) - exp(-depth);
        return fog_way(r.origin, r.direction, -log(fmax(R(1.0) - u * *weight, R(1e-30))), m);
    }
    const vec toward = vec_sub(vec_splat(light->vector), r.origin);
    const real nearest = vec_dot(toward, r.direction);
    const vec beside = vec_along(toward, -nearest, r.direction);
    const real distance = fmax(sqrt(vec_dot(beside, beside)), R(1e-6));
    const real first = real_atan2(-nearest, distance), last = real_atan2(fmin(far, R(1e30)) - nearest, distance);
    const real angle = first + u * (last - first);
    const real along = distance * sin(angle) / fmax(cos(angle), R(1e-7));
    const real t = clamp(nearest + along, R(0.0), far);
    const real passes = exp(-fog_depth(r.origin, r.direction, t, m));
    *weight = fog_density_at(r.origin, r.direction, t, m) * passes * (last - first) * (distance * distance + along * along) / distance;
    return t;
}

// Where the fog scatters a light to the eye, if nothing is between.
INLINE scattering scattered(stage s, const packet_pixels *at, ray r, real far, int light_index, world w) {
    light_record light = w.lights + light_index;
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed, (uint)(PURPOSE_AIR + 16 * (1 + light_index)));
    real u, v, weight;
    unit_square((bits)((uint)s.sample), seed, &u, &v);
    scattering found;
    found.t = scattering_place(r, far, u, light, w.material, &weight);
    found.in = light_at(light, vec_along(r.origin, found.t, r.direction), w.tables);
    if (light->spread > S(0.0)) {
        real other;
        unit_square((bits)((uint)s.sample), seed + 1u, &u, &other);
        found.in.toward = cone_direction(found.in.toward, (real)(light->spread), other, v);
    }
    // A light of intensity 1 is an irradiance of pi.
    found.share = R(3.141592653589793) * found.in.strength * weight
                  * phase_of(vec_dot(found.in.toward, r.direction), (real)(w.material->fog_anisotropy));
    return found;
}

// How far a ray from the eye goes through the fog.
INLINE real way_in_fog(stage s, ray r, const interaction *here, world w) {
    real far = way_to_interaction(here, r);
    light_hit_of(r.origin, r.direction, 1, &far, w);
    return far;
}
