// Lobes of materials, in a frame whose z is the normal: `o` towards the viewer, `i` towards the light, both of length 1.
#define BSDF_PI R(3.141592653589793)

INLINE real square(real a) { return a * a; }

// GGX's facets (Walter and others 2007): their slopes are `alpha` wide, q times that along x and over q along y of the frame. Kept are
// q^2 - 1 and 1 / q^2 - 1, which are 0 where they are the same all around.
typedef struct {
    real alpha, along, across;
} slopes;

INLINE slopes slopes_pick(mask m, slopes a, slopes b) {
    return (slopes){pick(m, a.alpha, b.alpha), pick(m, a.along, b.along), pick(m, a.across, b.across)};
}
INLINE slopes even_slopes(real alpha) { return (slopes){alpha, R(0.0), R(0.0)}; }

// Smith's function of one direction.
INLINE real ggx_lambda(vec a, slopes f) {
    const real z2 = fmax(a.z * a.z, R(1e-12)), level = R(1.0) - z2 + a.x * a.x * f.along + a.y * a.y * f.across;
    return R(0.5) * (sqrt(R(1.0) + f.alpha * f.alpha * fmax(level, R(0.0)) / z2) - R(1.0));
}

INLINE real ggx_normals(vec h, slopes f) {
    const real a2 = f.alpha * f.alpha;
    // (h.z^2 (a2 - 1) + 1), which loses its digits near h.z = 1.
    const real even = h.x * h.x + h.y * h.y, level = even + h.x * h.x * f.across + h.y * h.y * f.along, t = level + a2 * h.z * h.z;
    return a2 / (BSDF_PI * t * t);
}

INLINE vec middle_way(vec o, vec i) { return vec_normalize(vec_add(o, i)); }

// What GGX reflects, with a reflectance of 1: f * cosine. Both directions over the surface.
INLINE real ggx_value(vec o, vec i, vec h, slopes f) {
    return ggx_normals(h, f) / (R(4.0) * fmax(o.z, R(1e-6)) * (R(1.0) + ggx_lambda(o, f) + ggx_lambda(i, f)));
}

// Density per steradian of directions that visible normals mirror to.
INLINE real ggx_density(vec o, vec h, slopes f) {
    return ggx_normals(h, f) / (R(4.0) * fmax(o.z, R(1e-6)) * (R(1.0) + ggx_lambda(o, f)));
}

// A visible normal (Dupuy and Benyoub 2023).
INLINE vec ggx_facet(vec o, slopes f, real u, real v) {
    const real x = f.alpha * sqrt(R(1.0) + f.along), y = f.alpha * sqrt(R(1.0) + f.across);
    const vec stretched = vec_normalize(vec_of(x * o.x, y * o.y, o.z));
    const real z = R(1.0) - u * (R(1.0) + stretched.z);
    const real level = sqrt(fmax(R(1.0) - z * z, R(0.0))), angle = R(6.283185307179586) * v;
    const vec cap = vec_of(level * cos(angle) + stretched.x, level * sin(angle) + stretched.y, z + stretched.z);
    return vec_normalize(vec_of(x * cap.x, y * cap.y, cap.z));
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

// How much of a lobe counts, of which facets with this width reflect: sharp ones as highlights, broad ones as diffuse bodies.
INLINE real lobe_share(real broad, real sharp, real alpha) { return sharp + (broad - sharp) * alpha * alpha; }
