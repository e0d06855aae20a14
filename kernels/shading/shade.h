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

// What chooses colours is a file of `elements/colorings`' folders, with
//   color NAME_color(vec normal, material_record material)     in `colors`, if it is a colour by itself
//   real NAME_value(vec point, vec normal, real smooth, real residual, vec given)
//                                                              in `values`, if it is a number that is known with the interaction; `given`
//                                                              is a map's direction or place
// or the function of `coloring.h`.
#include "elements/colorings"
#include "elements/colorings/colors"
#include "elements/colorings/values"

#define VALUE(KIND, name) case COLORING_##KIND: return name##_value(point, normal, smooth, residual, given);
INLINE real value_known(int kind, vec point, vec normal, real smooth, real residual, vec given) {
    switch (kind) { VALUES(VALUE) default: return smooth; }
}

// Where a quantity lies in the palette, 0 to 1.
INLINE real palette_place(real quantity, material_record material) {
    return place_in_palette(quantity, material->palette_scale, material->palette_offset, material->palette_repeat);
}

// Whether a point's colour is known as soon as it is met: else one quantity chooses that of all a pixel's points.
INLINE int is_colored_at_once(material_record material) { return material->known == KNOWN_AT_HIT; }

// The surface's own colour M; `quantity` is what chooses it.
#define COLOR(KIND, name) case COLORING_##KIND: return name##_color(normal, material);
INLINE color surface_color(vec normal, real quantity, material_record material, __global const float *palette) {
    switch (material->coloring) {
        COLORS(COLOR)
        default: return palette_color(palette_place(quantity, material), material->palette_repeat, palette);
    }
}
