"""Materials as paths read them (`kernels/bsdf.h`)."""

from __future__ import annotations

from clfractal.device.orbit import Record
from clfractal.device.structs import Field, Precision, Struct
from clfractal.renderers.scattering import (
    COSINES,
    REFLECTANCES,
    ROUGHNESSES,
    SMOOTHEST_FUZZ_PARTS,
    SMOOTHEST_PARTS,
)
from clfractal.scene.materials import PbrMaterial
from clfractal.scene.model import Scene
from clfractal.scene.parts import Material

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
        Field("emission", "real", 3, "radiance, linear Rec. 709"),
    ],
)


def scattering_defines() -> dict[str, object]:
    """The defines of `kernels/bsdf.h`."""
    return {
        "ALBEDO_COSINES": COSINES,
        "ALBEDO_ROUGHNESSES": ROUGHNESSES,
        "ALBEDO_REFLECTANCES": REFLECTANCES,
        "SMOOTHEST_PARTS": SMOOTHEST_PARTS,
        "SMOOTHEST_FUZZ_PARTS": SMOOTHEST_FUZZ_PARTS,
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


def material_records(scene: Scene, precision: Precision) -> Record:
    """The set's material, then each object's."""
    own = used_material(scene)
    used = [
        own,
        *(scene.materials[each.material] if each.material else own for each in scene.objects.values()),
    ]
    return PBR.array(precision, [material_values(each) for each in used])


def material_values(material: PbrMaterial) -> dict[str, object]:
    """The fields of a record."""
    base, specular, coat, fuzz = material.base, material.specular, material.coat, material.fuzz
    shine = material.emission
    return {
        "base_weight": base.weight,
        "base_color": base.color if base.color is not None else (0.0, 0.0, 0.0),
        "base_own": int(base.color is not None),
        "base_metalness": base.metalness,
        "base_diffuse_roughness": base.diffuse_roughness,
        "specular_weight": specular.weight,
        "specular_color": specular.color,
        "specular_roughness": specular.roughness,
        "specular_ior": specular.ior,
        "coat_weight": coat.weight,
        "coat_color": coat.color,
        "coat_roughness": coat.roughness,
        "coat_ior": coat.ior,
        "coat_darkening": coat.darkening,
        "fuzz_weight": fuzz.weight,
        "fuzz_color": fuzz.color,
        "fuzz_roughness": fuzz.roughness,
        "emission": tuple(shine.luminance * part for part in shine.color),
    }
