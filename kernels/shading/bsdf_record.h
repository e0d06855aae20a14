// A material at an interaction: `pbr`, generated from clfractal/shading/materials.py, and made ready to scatter.
#include "shading/albedos.h"
#include "shading/microfacets.h"
#include "pbr.h"

// What of it is glass (`elements/materials/transmission.h`).
typedef struct {
    real weight;             // part of the surface that is glass
    real across;             // index of the side beyond over the viewer's ...
    real mirrors;            // ... and as reflectances have it: the mean of all colours, where they part only now
    slopes facets;
    real rough, root;
    mask inside;             // whether the viewer is
    color tint;              // of what crosses the boundary
    real lost, mean_lost;    // between facets: of the viewer's direction; of all on this side
    real mean_beyond;        // the same on the other side
    real crosses;
} glass;

// A film on the boundary of the base.
typedef struct {
    real weight;             // part of the surface that has it
    real thickness, ior;     // micrometres; index of refraction
    color through;           // what reaches the body, over what the boundary alone lets through
    color again;             // a metal's reflectance straight on with it, for light that meets several facets
} film;

// A material at an interaction, ready to scatter.
typedef struct {
    vec side, up, normal;   // the frame of all lobes ...
    vec out;                // ... and in it the direction to the viewer
    color body, metal, edge, gloss;   // diffuse colour; a metal's reflectance straight on and its tint at the edge; tint of a dielectric's
    slopes facets;                    // of the boundary
    real metalness, rough_body, rough, ior, root;   // ior and square root of the reflectance of the dielectric's boundary
    color coat_tint;
    slopes coat_facets;
    real coat, coat_rough, coat_ior, coat_root, coat_albedo;
    color fuzz;
    real fuzz_rough, fuzz_albedo;
    real by_coat, by_gloss;   // probabilities of sampling the coat's highlight, the base's highlight; else the hemisphere
    real dielectric;          // part of the surface that has a body
    mask seen;                // whether the viewer is over the surface
    int relief;               // whether the normal is that of a relief; see bsdf_bumped.h
    vec surface, leans;       // the surface's own normal, and where the other one leans to, length 1 each
    real level;               // cosine between the normals
    glass clear;
    real by_glass, by_beyond; // probabilities of its facets, and of the hemisphere beyond
    mask emerges;             // whether light comes from below the boundary, as from a white body whose viewer is below, too
    real bare;                // part of the body that is none of a medium
    film film;
    real more;                // part of the light that the boundary lets through which lobes are chosen as if it were reflected
    color below; real by_below; // what goes below the boundary, over the probability of choosing that, the last part of all choices
} bsdf;

INLINE real alpha_of(real roughness) { return fmax(roughness * roughness, SMOOTHEST); }
INLINE real luminance(color c) { return R(0.2126) * c.r + R(0.7152) * c.g + R(0.0722) * c.b; }
