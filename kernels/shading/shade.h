// Shading after the thesis's Eq. 5: for each light
//   colour * intensity * (ambient * M + s * (diffuse * M * max(0, N.L) + specular * max(0, R.V)^shininess)),
// M the surface's colour, s 0 in shadow and 1 outside. Colours are linear Rec. 709.
#include "shading/color.h"
#include "shading/light_at.h"

// x^shininess for 0 <= x: whole exponents by squaring, which loses no more than x itself has lost.
INLINE real highlight_of(real x, scalar shininess) {
    const int whole = (int)shininess;
    if (whole > 1024 || (scalar)whole != shininess) return pow(x, (real)(shininess));
    real power = R(1.0);
    for (int rest = whole; rest != 0; rest >>= 1) {
        if (rest & 1) power *= x;
        x *= x;
    }
    return power;
}

// How a surface faces a light: N.L, whether that lights it, and R.V if it is above 0, with R = 2 (N.L) N - L, the light's direction
// mirrored at the normal.
typedef struct {
    real facing, toward_viewer;
    mask front;
} attitude;

INLINE attitude attitude_to(incidence in, vec normal, vec to_viewer, mask lit) {
    const real facing = vec_dot(normal, in.toward);
    const vec mirrored = vec_sub(vec_scale(normal, R(2.0) * facing), in.toward);
    return (attitude){facing, fmax(vec_dot(mirrored, to_viewer), R(0.0)), lit & less(R(0.0), facing)};
}

// The light that one light adds. `lit` is s of Eq. 5; `open` is the unblocked part of the hemisphere, a factor on the ambient part;
// `to_viewer` has length 1.
INLINE color phong(color surface, vec normal, vec to_viewer, incidence in, mask lit, real open,
                   light_record light, material_record material) {
    const attitude a = attitude_to(in, normal, to_viewer, lit);
    const real diffuse = pick(a.front, (real)(material->diffuse) * a.facing, R(0.0));
    const real highlight = (real)(material->specular) * highlight_of(a.toward_viewer, material->shininess);
    const real specular = pick(a.front & less(R(0.0), a.toward_viewer), highlight, R(0.0));
    const real body = (real)(material->ambient) * open + diffuse;
    return color_of(in.strength * (real)(light->color[0]) * (body * surface.r + specular),
                    in.strength * (real)(light->color[1]) * (body * surface.g + specular),
                    in.strength * (real)(light->color[2]) * (body * surface.b + specular));
}

// Where coloring.h's quantity lies in the palette, 0 to 1.
INLINE real palette_place(real quantity, material_record material) {
    return place_in_palette(quantity, material->palette_scale, material->palette_offset, material->palette_repeat);
}

// Whether a point's colour is known as soon as it is met: else one quantity chooses that of all a pixel's points.
INLINE int is_colored_at_once(material_record material) { return material->coloring <= COLORING_ITERATIONS; }

// The surface's own colour M; `quantity` is that of coloring.h.
INLINE color surface_color(vec normal, real quantity, material_record material, __global const float *palette) {
    if (material->coloring == COLORING_SOLID) return color_splat(material->color);
    // The thesis stores normals as (n + 1) / 2 in RGB (sec. 3.2.1).
    if (material->coloring == COLORING_NORMAL) return color_of(R(0.5) * normal.x + R(0.5), R(0.5) * normal.y + R(0.5), R(0.5) * normal.z + R(0.5));
    return palette_color(palette_place(quantity, material), material->palette_repeat, palette);
}
