"""Materials as paths read them (`kernels/shading/bsdf.h`)."""

from __future__ import annotations

from collections.abc import Iterator

from clfractal.device.structs import Field, Struct
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.materials import PARTS, PbrMaterial
from clfractal.scene.model import Scene
from clfractal.scene.parts import Material
from clfractal.schema.mapped import Map
from clfractal.shading.scattering import (
    AGAIN_TENTHS,
    COSINES,
    EVEN_HUNDREDTHS,
    NARROWEST_TENTHS,
    REFLECTANCES,
    ROUGHNESSES,
    SMOOTHEST_FUZZ_PARTS,
    SMOOTHEST_PARTS,
    WAVELENGTHS,
    albedo_tables,
)

PARAMETERS = tuple(parameter for part in PARTS for parameter in part.parameters())
"""What a material has in each lane, in the order of its numbers there."""


def _fields() -> Iterator[Field]:
    for each in PARAMETERS:
        yield Field(each.name, "real", each.count if each.count > 1 else 0, each.meaning)
        if each.optional:
            yield Field(f"{each.name}_own", "int", 0, "1: it is that; 0: the colouring's")


PBR = Struct(
    "Pbr",
    [
        *_fields(),
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


def parameter_numbers() -> dict[str, tuple[int, int]]:
    """Of each parameter by its name in `PBR` the place of its first number in a lane's material, and how many it has."""
    found, place = {}, 0
    for each in PARAMETERS:
        found[each.name] = (place, each.count)
        place += each.count
    return found


def weighed_text() -> str:
    """Which numbers of a material count by weights in a blend (`material_at.h`)."""
    numbers, listed = parameter_numbers(), []
    for part in PARTS:
        if part.counts_by_weight:
            weight, *others = (numbers[each.name] for each in part.parameters())
            listed.append(f"{{{weight[0]}, {sum(count for _, count in others)}}}")
    return (
        "// Of each part of a material whose numbers count by its weight: the number of that weight, and how many follow.\n"
        f"#define WEIGHED_PARTS {len(listed)}\n"
        f"__constant const int WEIGHED[WEIGHED_PARTS][2] = {{{', '.join(listed)}}};\n"
    )


# What `pbr_text` adds to them.
MORE_NUMBERS = 3


def matter_numbers() -> int:
    """Numbers of a material in a lane."""
    return sum(each.count for each in PARAMETERS) + MORE_NUMBERS


def pbr_text() -> str:
    """The type of a lane's material, how one begins as a record, and a matt one: the same everywhere (`bsdf.h`)."""
    reads = {"real": "(real)(m->{})", "color": "color_splat(m->{})", "vec": "vec_splat(m->{})"}
    lines = [
        "// The parameters of a material at an interaction, which may differ from lane to lane.",
        "typedef struct {",
        *(f"    {each.kind} {each.name};" for each in PARAMETERS),
        "    real inside;        // whether the viewer is inside the glass",
        "    real bending_ior;   // the index that bends light, of one colour of it",
        "    real emerges;       // whether light comes from below the boundary",
        "} pbr;",
        "// `tint`: the colouring's colour.",
        "INLINE pbr pbr_of(__constant const struct Pbr *m, color tint) {",
        "    pbr p;",
    ]
    for each in PARAMETERS:
        read = reads[each.kind].format(each.name)
        own = f"m->{each.name}_own ? {read} : tint" if each.optional else read
        lines.append(f"    p.{each.name} = {own};")
    lines += [
        "    p.inside = R(0.0);",
        "    p.bending_ior = p.specular_ior;",
        "    p.emerges = R(0.0);",
        "    return p;",
        "}",
        "// Leaves nothing but a matt body.",
        "INLINE void pbr_matt(pbr *p) {",
        *(f"    p->{part.tag}_{name} = R(0.0);" for part in PARTS for name in part.zero_if_matt),
        "}",
        "",
    ]
    return "\n".join(lines)


def scattering_defines() -> dict[str, object]:
    """The defines of `kernels/shading/bsdf.h`."""
    return {
        "SPECTRUM_PLACES": WAVELENGTHS,
        "ALBEDO_COSINES": COSINES,
        "ALBEDO_ROUGHNESSES": ROUGHNESSES,
        "ALBEDO_REFLECTANCES": REFLECTANCES,
        "ALBEDO_ALL": albedo_tables().size,
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
    found: PbrMaterial = PbrMaterial.model_validate(
        {
            "base": {"weight": min(material.diffuse, 1.0)},
            "specular": {"weight": min(material.specular, 1.0), "roughness": roughness},
        }
    )
    return found


def used_material(scene: Scene) -> PbrMaterial:
    """The material of a scene's surface along paths: the one that it names, or what Phong's is there."""
    name = scene.material.name
    found: PbrMaterial = scene.materials[name] if name is not None else of_phong(scene.material)
    return found


def used_materials(scene: Scene) -> list[PbrMaterial]:
    """The set's material, then each object's."""
    own = used_material(scene)
    named = [each.material for each in scene.objects.values()]
    return [own, *(scene.materials[name] if name is not None else own for name in named)]


def face_materials(scene: Scene) -> dict[str, PbrMaterial]:
    """The materials of the faces of cuts along paths, by name."""
    if not isinstance(scene.lighting, PathLighting):
        return {}
    names = [plane.material for plane in scene.cut_planes if plane.cut and plane.material is not None]
    return {name: scene.materials[name] for name in names}


def material_values(material: PbrMaterial) -> dict[str, object]:
    """The fields of a record."""
    values: dict[str, object] = {"first_map": 0, "map_count": 0, "blend": (-1, -1), "mask": -1}
    values |= {"bump": -1, "bump_width": -1.0}
    for part in PARTS:
        packed = getattr(material, part.tag).packed()
        for each in part.parameters():
            value = packed[each.name.removeprefix(f"{part.tag}_")]
            if each.optional:
                values[f"{each.name}_own"] = int(value is not None)
            # What differs from place to place is put in where it is known.
            unknown = value is None or isinstance(value, Map)
            values[each.name] = (0.0 if each.count == 1 else (0.0,) * each.count) if unknown else value
    return values
