// Lobes of materials, in a frame whose z is the normal: `o` towards the viewer, `i` towards the light, both of length 1.
#define BSDF_PI R(3.141592653589793)

INLINE real square(real a) { return a * a; }

// GGX (Walter and others 2007) with a width alpha. Smith's function of one direction.
INLINE real ggx_lambda(vec a, real alpha) {
    const real z2 = fmax(a.z * a.z, R(1e-12));
    return R(0.5) * (sqrt(R(1.0) + alpha * alpha * fmax(R(1.0) - z2, R(0.0)) / z2) - R(1.0));
}

INLINE real ggx_normals(vec h, real alpha) {
    const real a2 = alpha * alpha;
    // (h.z^2 (a2 - 1) + 1), which loses its digits near h.z = 1.
    const real level = h.x * h.x + h.y * h.y, t = level + a2 * h.z * h.z;
    return a2 / (BSDF_PI * t * t);
}

INLINE vec middle_way(vec o, vec i) { return vec_normalize(vec_add(o, i)); }

// What GGX reflects, with a reflectance of 1: f * cosine. Both directions over the surface.
INLINE real ggx_value(vec o, vec i, vec h, real alpha) {
    return ggx_normals(h, alpha) / (R(4.0) * fmax(o.z, R(1e-6)) * (R(1.0) + ggx_lambda(o, alpha) + ggx_lambda(i, alpha)));
}

// Density per steradian of directions that visible normals mirror to.
INLINE real ggx_density(vec o, vec h, real alpha) {
    return ggx_normals(h, alpha) / (R(4.0) * fmax(o.z, R(1e-6)) * (R(1.0) + ggx_lambda(o, alpha)));
}

// A visible normal (Dupuy and Benyoub 2023).
INLINE vec ggx_facet(vec o, real alpha, real u, real v) {
    const vec stretched = vec_normalize(vec_of(alpha * o.x, alpha * o.y, o.z));
    const real z = R(1.0) - u * (R(1.0) + stretched.z);
    const real level = sqrt(fmax(R(1.0) - z * z, R(0.0))), angle = R(6.283185307179586) * v;
    const vec cap = vec_of(level * cos(angle) + stretched.x, level * sin(angle) + stretched.y, z + stretched.z);
    return vec_normalize(vec_of(alpha * cap.x, alpha * cap.y, cap.z));
}

// The direction that `o` is mirrored to there; it may be below the surface.
INLINE vec mirrored_by(vec o, vec h) { return vec_sub(vec_scale(h, R(2.0) * vec_dot(o, h)), o); }

// The reflectance of a dielectric's boundary from outside (exact, unpolarised).
INLINE real fresnel_dielectric(real cosine, real ior) {
    const real g = sqrt(fmax(ior * ior - R(1.0) + cosine * cosine, R(0.0)));
    const real a = (g - cosine) / fmax(g + cosine, R(1e-12));
    const real b = (cosine * (g + cosine) - R(1.0)) / (cosine * (g - cosine) + R(1.0));
    return pick(less_equal(ior, R(1.0)), R(0.0), R(0.5) * a * a * (R(1.0) + b * b));
}

// How far a metal's tint takes its reflectance below Schlick's, in parts of cosine (1 - cosine)^6: (6/7)^5, and (6/7)^6 / 7.
INLINE real metal_dip(real straight, real tint) {
    return (straight + (R(1.0) - straight) * R(0.462664366)) * (R(1.0) - tint) / R(0.0566527795);
}

// The reflectance of a metal, of (1 - cosine)^5 and cosine (1 - cosine)^6, or of their means.
INLINE real metal_reflects(real straight, real dip, real rest5, real dipped) {
    return clamp(straight + (R(1.0) - straight) * rest5 - dip * dipped, R(0.0), R(1.0));
}

// By Schlick, with a tint where the cosine is 1/7 (Kutz, Hasan, Edmondson 2021), as in OpenPBR.
INLINE real fresnel_metal(real cosine, real straight, real tint) {
    const real rest = fmax(R(1.0) - cosine, R(0.0)), rest2 = rest * rest, rest5 = rest2 * rest2 * rest;
    return metal_reflects(straight, metal_dip(straight, tint), rest5, cosine * rest5 * rest);
}

// Diffuse light of rough surfaces, with all its energy (Portsmouth, Kutz, Hill 2024, EON).
#define EON_SLOPE R(0.28779341)   // 1/2 - 2/(3 pi)
#define EON_MEAN R(0.07248821)    // 2/3 - 28/(15 pi)
INLINE real eon_albedo(real cosine, real roughness) {
    const real a = R(1.0) / (R(1.0) + EON_SLOPE * roughness);
    const real c = clamp(cosine, R(1e-4), R(1.0)), sine = sqrt(fmax(R(1.0) - c * c, R(0.0)));
    const real g = sine * (acos(c) - sine * c) + R(0.6666666666666667) * (sine / c * (R(1.0) - sine * sine * sine) - sine);
    return a * (R(1.0) + roughness * g / BSDF_PI);
}
// f, not times the cosine, of one component of the colour.
INLINE real eon_part(real base, real single, real less_o, real less_i, real mean) {
    const real several = base * base * mean / (R(1.0) - base * (R(1.0) - mean));
    return base * single + several * less_o * less_i / fmax(R(1.0) - mean, R(1e-6)) / BSDF_PI;
}
INLINE color eon_value(color base, vec o, vec i, real roughness) {
    const real a = R(1.0) / (R(1.0) + EON_SLOPE * roughness);
    const real s = o.x * i.x + o.y * i.y;  // o.i - o.z i.z
    const real over = pick(less(R(0.0), s), s / fmax(fmax(o.z, i.z), R(1e-6)), s);
    const real single = a * (R(1.0) + roughness * over) / BSDF_PI, mean = a * (R(1.0) + EON_MEAN * roughness);
    const real less_o = R(1.0) - eon_albedo(o.z, roughness), less_i = R(1.0) - eon_albedo(i.z, roughness);
    return color_of(eon_part(base.r, single, less_o, less_i, mean), eon_part(base.g, single, less_o, less_i, mean),
                    eon_part(base.b, single, less_o, less_i, mean));
}

// Fibres that stand on the surface: Estevez and Kulla 2017 with the shadows of Neubelt and Pettineo 2013. f, not times the cosine.
INLINE real fuzz_value(vec o, vec i, real roughness) {
    const real power = R(1.0) / fmax(roughness, SMOOTHEST_FUZZ);
    const vec h = middle_way(o, i);
    const real sine2 = fmax(R(1.0) - h.z * h.z, R(1e-12));
    const real density = (R(2.0) + power) * pow(sine2, R(0.5) * power) / (R(2.0) * BSDF_PI);
    return density / (R(4.0) * fmax(o.z + i.z - o.z * i.z, R(1e-6)));
}
