"""Clear bodies with smooth or nearly smooth boundaries, through which lights are sampled (`bent_light.h`)."""

from __future__ import annotations

from clfractal.elements.shapes.box import BoxObject
from clfractal.elements.shapes.plane import PlaneObject
from clfractal.elements.shapes.sphere import SphereObject
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.materials import PbrMaterial
from clfractal.scene.model import Scene
from clfractal.scene.objects import WaterObject
from clfractal.schema.mapped import Map
from clfractal.schema.material import BLACK
from clfractal.schema.shape import ObjectBase, Solid
from clfractal.shading.maps import MappedMaterials
from clfractal.shading.materials import used_materials

ROUGHEST = 0.2
"""Roughness above which light that is scattered between facets, which no chain leads to, is no longer next to nothing."""


def is_clear(material: PbrMaterial) -> bool:
    """Whether light goes through a material as through a polished or slightly rough pane: the same at all places and of
    all colours, and without being scattered within.
    """
    if material.blend is not None:
        return False
    layers = (material.transmission, material.specular, material.coat, material.fuzz, material.thin_film)
    if any(isinstance(getattr(part, key), Map) for part in layers for key in type(part).model_fields):
        return False
    glass = material.transmission
    bare = material.coat.weight == 0 and material.fuzz.weight == 0 and material.thin_film.weight == 0
    surface = material.specular
    even = surface.roughness == 0 or (surface.roughness <= ROUGHEST and surface.anisotropy == 0)
    smooth = even and material.subsurface.weight == 0 and material.base.metalness == 0
    clear: bool = glass.weight > 0 and glass.scatter == BLACK and glass.dispersion_scale == 0
    return clear and bare and smooth


def crossings(body: ObjectBase) -> int:
    """Over how many boundaries of a body light is sampled: one of a plane or water, two of a solid, none of others."""
    return 2 if isinstance(body, Solid) else int(isinstance(body, PlaneObject | WaterObject))


def is_found(body: ObjectBase, material: PbrMaterial) -> bool:
    """Whether chains have less noise than chance: over rough boundaries where these are flat, since facets tear the
    chains of curved ones apart.
    """
    level = isinstance(body, PlaneObject | BoxObject) or (
        isinstance(body, WaterObject) and body.waves.height == 0
    )
    return material.specular.roughness == 0 or level


def is_shot(body: ObjectBase, material: PbrMaterial) -> bool:
    """Whether chains through a body that is crossed twice are found by shooting rays: through all but smooth round
    balls, since facets lead them out of the plane of both ends.
    """
    round_ball = isinstance(body, SphereObject) and len(set(body.scale)) == 1
    return isinstance(body, Solid) and not (round_ball and material.specular.roughness == 0)


def clear_bodies(scene: Scene) -> list[int]:
    """Of each object over how many of its boundaries light is sampled: of clear ones that no plane cuts."""
    none = [0] * len(scene.objects)
    if not isinstance(scene.lighting, PathLighting) or MappedMaterials(scene).has_bump:
        return none
    cut = {name for plane in scene.cut_planes for name in plane.cut_objects}
    return [
        crossings(each)
        if name not in scene.joined and name not in cut and is_clear(material) and is_found(each, material)
        else 0
        for (name, each), material in zip(scene.objects.items(), used_materials(scene)[1:], strict=True)
    ]


def has_shot_bodies(scene: Scene) -> bool:
    """Whether light is sampled through a body of which `is_shot` is true."""
    rows = zip(clear_bodies(scene), scene.objects.values(), used_materials(scene)[1:], strict=True)
    return any(over and is_shot(each, material) for over, each, material in rows)
