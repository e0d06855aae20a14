"""Materials as paths read them (`kernels/shading/bsdf.h`)."""

from __future__ import annotations

from clfractal.device.structs import Field, Struct
from clfractal.scene.materials import PbrMaterial
from clfractal.scene.model import Scene
from clfractal.scene.parts import Material
from clfractal.schema.mapped import Map
from clfractal.shading.facets import AGAIN_TENTHS, EVEN_HUNDREDTHS, NARROWEST_TENTHS
from clfractal.shading.glass import WAVELENGTHS
from clfractal.shading.scattering import (
    COSINES,
    REFLECTANCES,
    ROUGHNESSES,
    SMOOTHEST_FUZZ_PARTS,
    SMOOTHEST_PARTS,
)

PBR = Struct(
    "Pbr",
    [
        Field("base_weight", "real", 0, "factor on the colour"),
        Field("base_color", "real", 3, "linear Rec. 709"),
        Field("base_own", "int", 0, "1: the body has this colour; 0: the colouring's"),
        Field("base_metalness", "real", 0, "0: a dielectric, 1: a metal"),
        Field("base_diffuse_roughness", "real", 0, "EON's, 0 to 1"),
        Field("specular_weight", "real", 0, "factor on a dielectric's reflectance, straight on"),
        Field("specular_color", "real", 3, "a dielectric's tint, a metal's at the edge"),
        Field("specular_roughness", "real", 0, "0 to 1"),
        Field("specular_ior", "real", 0, "1 or more"),
        Field("coat_weight", "real", 0, "part of the surface with a coat"),
        Field("coat_color", "real", 3, "what passes there and back"),
        Field("coat_roughness", "real", 0, "0 to 1"),
        Field("coat_ior", "real", 0, "1 or more"),
        Field("coat_darkening", "real", 0, "0 to 1"),
        Field("fuzz_weight", "real", 0, "0 to 1"),
        Field("fuzz_color", "real", 3, "linear Rec. 709"),
        Field("fuzz_roughness", "real", 0, "SMOOTHEST_FUZZ to 1"),
        Field(
            "emission_luminance",
            "real",
            0,
            "factor on the colour, where that differs from place to place; else 1",
        ),
        Field("emission_color", "real", 3, "radiance, linear Rec. 709"),
        Field("transmission_weight", "real", 0, "part of the body that is glass"),
        Field("transmission_color", "real", 3, "what is left of light after the depth"),
        Field("transmission_depth", "real", 0, "scene units; 0: the colour tints the boundary"),
        Field("transmission_scatter", "real", 3, "scattered on that way, in mean free paths"),
        Field("transmission_scatter_anisotropy", "real", 0, "Henyey and Greenstein's g"),
        Field("transmission_dispersion_scale", "real", 0, "0 to 1"),
        Field("transmission_dispersion_abbe_number", "real", 0, "1 or more"),
        Field("subsurface_weight", "real", 0, "part of the diffuse body that is a medium"),
        Field("subsurface_color", "real", 3, "what comes out of a thick body"),
        Field("subsurface_radius", "real", 0, "mean free path, scene units"),
        Field("subsurface_radius_scale", "real", 3, "factor on that"),
        Field("subsurface_scatter_anisotropy", "real", 0, "Henyey and Greenstein's g"),
        Field("first_map", "int", 0, "of the parameters that differ from place to place"),
        Field("map_count", "int", 0, ""),
        Field(
            "blend",
            "int",
            2,
            "the numbers of the materials that this one is made of; -1: it has layers of its own",
        ),
        Field("mask", "int", 0, "the map of the second one's share"),
        Field("bump", "int", 0, "the map of its height; -1: there is none"),
        Field(
            "bump_width",
            "real",
            0,
            "least distance over which slopes are measured, scene units; below 0: there are none",
        ),
    ],
)
PARAMETERS = tuple(field for field in PBR.fields if field.type == "real" and field.name != "bump_width")
"""What a material has in each lane, in the order of its numbers there."""


def parameter_numbers() -> dict[str, tuple[int, int]]:
    """Of each parameter by its name in `PBR` the place of its first number in a lane's material, and how many it has."""
    found, place = {}, 0
    for field in PARAMETERS:
        found[field.name] = (place, max(field.count, 1))
        place += max(field.count, 1)
    return found


# What `pbr_text` adds to them.
MORE_NUMBERS = 3


def matter_numbers() -> int:
    """Numbers of a material in a lane."""
    return sum(max(field.count, 1) for field in PARAMETERS) + MORE_NUMBERS


def pbr_text() -> str:
    """The type of a lane's material, and how one begins as a record: the same everywhere (`bsdf.h`)."""
    kinds = {0: "real", 3: "color"}
    lines = [
        "// The parameters of a material at an interaction, which may differ from lane to lane.",
        "typedef struct {",
    ]
    lines += [f"    {kinds[field.count]} {field.name};" for field in PARAMETERS]
    lines += [
        "    real inside;        // whether the viewer is inside the glass",
        "    real bending_ior;   // the index that bends light, of one colour of it",
        "    real emerges;       // whether light comes from below the boundary",
        "} pbr;",
        "// `tint`: the colouring's colour.",
    ]
    lines += ["INLINE pbr pbr_of(__constant const struct Pbr *m, color tint) {", "    pbr p;"]
    for field in PARAMETERS:
        read = f"color_splat(m->{field.name})" if field.count else f"(real)(m->{field.name})"
        own = f"m->base_own ? {read} : tint" if field.name == "base_color" else read
        lines.append(f"    p.{field.name} = {own};")
    return "\n".join(
        [
            *lines,
            "    p.inside = R(0.0);",
            "    p.bending_ior = p.specular_ior;",
            "    p.emerges = R(0.0);",
            "    return p;",
            "}",
            "",
        ]
    )


def scattering_defines() -> dict[str, object]:
    """The defines of `kernels/shading/bsdf.h`."""
    return {
        "SPECTRUM_PLACES": WAVELENGTHS,
        "ALBEDO_COSINES": COSINES,
        "ALBEDO_ROUGHNESSES": ROUGHNESSES,
        "ALBEDO_REFLECTANCES": REFLECTANCES,
        "SMOOTHEST_PARTS": SMOOTHEST_PARTS,
        "SMOOTHEST_FUZZ_PARTS": SMOOTHEST_FUZZ_PARTS,
        "REPEATED_EVEN_HUNDREDTHS": EVEN_HUNDREDTHS,
        "REPEATED_NARROWEST_TENTHS": NARROWEST_TENTHS,
        "REPEATED_AGAIN_TENTHS": AGAIN_TENTHS,
    }


def of_phong(material: Material) -> PbrMaterial:
    """What Phong's material is along paths: its highlight becomes a dielectric's boundary of about the same width."""
    # cos^n is as wide as GGX with alpha^2 = 2 / (n + 2) (Walter and others 2007), and roughness is the root of alpha.
    roughness = min((2 / (material.shininess + 2)) ** 0.25, 1.0)
    return PbrMaterial.model_validate(
        {
            "base": {"weight": min(material.diffuse, 1.0)},
            "specular": {"weight": min(material.specular, 1.0), "roughness": roughness},
        }
    )


def used_material(scene: Scene) -> PbrMaterial:
    """The material of a scene's surface along paths: the one that it names, or what Phong's is there."""
    name = scene.material.name
    return scene.materials[name] if name is not None else of_phong(scene.material)


def used_materials(scene: Scene) -> list[PbrMaterial]:
    """The set's material, then each object's."""
    own = used_material(scene)
    named = [each.material for each in scene.objects.values()]
    return [own, *(scene.materials[name] if name is not None else own for name in named)]


def material_values(material: PbrMaterial) -> dict[str, object]:
    """The fields of a record."""
    values: dict[str, object] = {}
    for part in ("base", "specular", "coat", "fuzz", "transmission", "subsurface"):
        section = getattr(material, part)
        for name in type(section).model_fields:
            values[f"{part}_{name}"] = getattr(section, name)
    values["base_own"] = int(material.base.color is not None)
    luminance, color = material.emission.luminance, material.emission.color
    if isinstance(luminance, Map) or isinstance(color, Map):
        values |= {"emission_luminance": luminance, "emission_color": color}
    else:
        values |= {"emission_luminance": 1.0, "emission_color": tuple(luminance * part for part in color)}
    values |= {"first_map": 0, "map_count": 0, "blend": (-1, -1), "mask": -1}
    values |= {"bump": -1, "bump_width": -1.0}
    # What differs from place to place is put in where it is known.
    sizes = {field.name: field.count for field in PARAMETERS}
    for name, value in values.items():
        if value is None or isinstance(value, Map):
            values[name] = (0.0,) * sizes[name] if sizes[name] else 0.0
    return values
