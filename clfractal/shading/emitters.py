"""Objects that shine, which paths sample as they sample lights (`kernels/shading/emitters.h`)."""

from __future__ import annotations

from clfractal.scene.light_paths import PathLighting
from clfractal.scene.materials import PbrMaterial
from clfractal.scene.model import Scene
from clfractal.schema.base import Vector
from clfractal.schema.mapped import Map
from clfractal.schema.shape import Solid
from clfractal.shading.maps import glass_bodies
from clfractal.shading.materials import used_materials


def sampled_radiance(scene: Scene) -> list[Vector | None]:
    """Of each object the radiance, linear Rec. 709, with which paths sample it; None where they do not.

    Solids that stand beside the set are sampled where they shine the same everywhere. What differs from place to
    place, blends, glass, which shines inside too, what planes cut, and what is joined to the set are found by chance alone.
    """
    if not isinstance(scene.lighting, PathLighting):
        return [None] * len(scene.objects)
    found: list[Vector | None] = []
    cut = {name for plane in scene.cut_planes for name in plane.cut_objects}
    materials, glass = used_materials(scene)[1:], glass_bodies(scene)[1:]
    for (name, each), material, through in zip(scene.objects.items(), materials, glass, strict=True):
        beside = isinstance(each, Solid) and name not in scene.joined and name not in cut
        found.append(even_radiance(material) if beside and not through else None)
    return found


def even_radiance(material: PbrMaterial) -> Vector | None:
    """The light of a material that is the same everywhere, linear Rec. 709; None if it is not, or if there is none."""
    luminance, color = material.emission.luminance, material.emission.color
    if material.blend is not None or isinstance(luminance, Map) or isinstance(color, Map):
        return None
    red, green, blue = color
    return (luminance * red, luminance * green, luminance * blue) if luminance * max(color) > 0 else None
