// Light that fog scatters towards the eye: for each light and sample one place of the ray, and from there a ray to the light. Where
// the set is in the way, the fog is dark: shafts of light stand between the shadows.

// The fog's density at a distance along a ray.
INLINE real fog_density_at(vec origin, vec direction, real t, material_record m) {
    if (m->fog_height <= S(0.0)) return (real)(m->fog_density);
    const real level = fog_level(origin, m) + t * fog_level(direction, m) - (real)(m->fog_base);
    return (real)(m->fog_density) * exp(fmin(-level / (real)(m->fog_height), FOG_THICKEST));
}

#define FOG_HIGH R(20.0)   // heights of the fog

// How far along a ray the optical depth is reached.
INLINE real fog_way(vec origin, vec direction, real depth, material_record m) {
    const real even = depth / fog_density_at(origin, direction, R(0.0), m);
    if (m->fog_height <= S(0.0)) return even;
    const real bend = fog_level(direction, m) / (real)(m->fog_height), c = even * bend;
    const mask level = less(fabs(c), R(0.03));
    const real curved = -log(fmax(R(1.0) - c, R(1e-30))) / pick(level, R(1.0), bend);
    const real way = pick(level, even * (R(1.0) + c * (R(0.5) + c * (R(0.33333333) + c * R(0.25)))), curved);
    // High above the fog hardly any is at the origin, and `even` may be more than a number can tell.
    const real above = (fog_level(origin, m) - (real)(m->fog_base)) / (real)(m->fog_height);
    const mask high = less(FOG_HIGH, above) & less(bend, R(0.0));
    const real left = exp(-above) - depth * bend / (real)(m->fog_density);
    return pick(high, -(above + log(fmax(left, R(1e-30)))) / pick(high, bend, R(-1.0)), way);
}

// A ray through fog up to `far`: the part of light from everywhere that it scatters, and the place before which it scatters half of that.
typedef struct {
    ray r;
    real far, all, middle;
} air_way;

INLINE real place_by_depth(const air_way *way, real u, material_record m) {
    return fog_way(way->r.origin, way->r.direction, -log(fmax(R(1.0) - u * way->all, R(1e-30))), m);
}

INLINE air_way air_way_of(ray r, real far, material_record m) {
    const real depth = pick(less(far, R(1e30)), fog_depth(r.origin, r.direction, fmin(far, R(1e30)), m),
                            -log(fmax(fog_passes_all(r.origin, r.direction, m), R(1e-30))));
    air_way way = {r, far, R(1.0) - exp(-depth), R(0.0)};
    way.middle = clamp(place_by_depth(&way, R(0.5), m), R(0.0), R(1e15));
    return way;
}

// What the fog scatters at a place of the ray of what comes there, per unit of the way, and what of that comes through to the eye.
INLINE real scattered_at(const air_way *way, real t, material_record m) {
    return fog_density_at(way->r.origin, way->r.direction, t, m) * exp(-fog_depth(way->r.origin, way->r.direction, t, m));
}

// The ray from where a light stands: how far along it is the nearest place, how far beside, and the angles of both its ends. And about
// what of the light it scatters to the eye: near the light, and where the fog is.
typedef struct {
    real nearest, beside, first, last;
    real near, by_depth;
} air_about;

// (What stands at the middle itself is no nearer to most of the fog than `core`, a square: a third of the way to there. Within what is
// larger, light comes from all around: fog by depth scatters most, and the core is 0.)
INLINE real air_core(const air_way *way) { return R(0.1) * way->middle * way->middle; }

INLINE air_about air_about_place(const air_way *way, vec place, real radius, real core, material_record m) {
    air_about a;
    const real least_beside = fmax(radius, R(1e-6)), end = fmin(way->far, R(1e30));
    const vec toward = vec_sub(place, way->r.origin);
    a.nearest = vec_dot(toward, way->r.direction);
    const vec beside = vec_along(toward, -a.nearest, way->r.direction), apart = vec_along(toward, -way->middle, way->r.direction);
    a.beside = fmax(sqrt(vec_dot(beside, beside)), least_beside);
    a.first = real_atan2(-a.nearest, a.beside);
    a.last = real_atan2(end - a.nearest, a.beside);
    a.near = scattered_at(way, clamp(a.nearest, R(0.0), end), m) * (a.last - a.first) / a.beside;
    a.by_depth = way->all / (vec_dot(apart, apart) + core + least_beside * least_beside);
    return a;
}

// The place of a sample on the ray by the angle at a light (Kulla and Fajardo 2012), or by what comes through, as likely as either brings
// more; and what the fog scatters there over the density of the choice by both (the balance heuristic, Veach and Guibas 1995).
INLINE real place_about(const air_way *way, const air_about *a, real u, material_record m, real *weight) {
    const real share = clamp(a->near / fmax(a->near + a->by_depth, (real)(REAL_SMALLEST)), R(0.0), R(1.0)), rest = R(1.0) - share;
    const mask near = less(u, share);
    u = pick(near, u, u - share) / fmax(pick(near, share, rest), (real)(REAL_SMALLEST));
    const real wide = a->last - a->first, angle = a->first + u * wide;
    const real by_angle = a->nearest + a->beside * sin(angle) / fmax(cos(angle), R(1e-7));
    const real t = clamp(pick(near, by_angle, place_by_depth(way, u, m)), R(0.0), way->far), along = t - a->nearest;
    const real scatters = scattered_at(way, t, m);
    // (A light on the ray's own line is seen under no angle.)
    const mask turns = less(R(0.0), wide);
    const real of_angle = share * a->beside / (pick(turns, wide, R(1.0)) * (a->beside * a->beside + along * along));
    const real density = pick(turns, of_angle, R(0.0)) + rest * scatters / fmax(way->all, (real)(REAL_SMALLEST));
    *weight = scatters / fmax(density, (real)(REAL_SMALLEST));
    return t;
}

// A place that scatters light, the ray from there to the light, and which part of its light comes to the eye.
typedef struct {
    real t;
    incidence in;
    real share;
} scattering;

// Where the fog scatters a light to the eye, by numbers in [0, 1): one for the place, two for that of the light.
INLINE scattering scattered_of(const air_way *way, light_record light, real u, real v, real other, world w) {
    real weight = way->all;
    scattering found;
    if (!light->seen && !light->inverse_square) {
        found.t = place_by_depth(way, u, w.material);
    } else {
        const air_about about = air_about_place(way, vec_splat(light->vector), R(0.0), air_core(way), w.material);
        found.t = place_about(way, &about, u, w.material, &weight);
    }
    const vec point = vec_along(way->r.origin, found.t, way->r.direction);
    found.in = light_at(light, point, w.tables);
    if (light->seen || light->spread > S(0.0)) found.in.toward = light_direction(light, point, found.in.toward, other, v);
    if (light->seen) found.in = light_along(light, point, found.in.toward, w.tables);
    // A light of intensity 1 is an irradiance of pi.
    found.share = R(3.141592653589793) * found.in.strength * weight
                  * phase_of(vec_dot(found.in.toward, way->r.direction), (real)(w.material->fog_anisotropy));
    return found;
}

// The numbers of a light, for the place on the ray and for the light's own place. Beside single lights, however many there are:
#define AIR_SUN (-1)
#define AIR_OTHERS (1 << 20)
INLINE void air_numbers(stage s, const packet_pixels *at, int number, world w, real *u, real *v, real *other) {
    const bits seed = pixel_seed(at->columns, at->rows, (uint)w.settings->seed, (uint)(PURPOSE_AIR + 16 * (1 + number)));
    real unused;
    unit_square((bits)((uint)s.sample), seed, u, v);
    unit_square((bits)((uint)s.sample), seed + 1u, &unused, other);
}

// How far a ray from the eye goes through the fog.
INLINE real way_in_fog(stage s, ray r, const interaction *here, world w) {
    real far = way_to_interaction(here, r);
    light_hit_of(r.origin, r.direction, 1, &far, w);
    return far;
}
