"""What light goes into along paths: materials, and whether the parts of a set differ in that."""

from clfractal.scene.blends import is_glass, is_subsurface
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.scene.surface import SurfaceRenderer


def lets_through(scene: Scene, material: str | None) -> bool:
    """Whether a material is glass along paths."""
    if material is None or not isinstance(scene.lighting, PathLighting):
        return False
    return is_glass(scene.materials[material], scene.materials)


def light_goes_into(scene: Scene, material: str | None) -> str:
    """What light goes into along paths: "glass", or what has "subsurface"; "" for all else."""
    if lets_through(scene, material):
        return "glass"
    paths = isinstance(scene.lighting, PathLighting)
    subsurface = paths and material is not None and is_subsurface(scene.materials[material], scene.materials)
    return "subsurface" if subsurface else ""


def has_glass_parts(scene: Scene) -> bool:
    """Whether the set has parts of glass beside others: each is a body for itself then. All of one glass are one body."""
    if not isinstance(scene.renderer, SurfaceRenderer):
        return False
    own = scene.material.name
    added = [each.material or own for each in scene.joined.values() if each.join == "union"]
    kinds = {name if light_goes_into(scene, name) else None for name in (own, *added)}
    return len(kinds) > 1 and any(lets_through(scene, name) for name in kinds)


MAX_RECORDS = 128
"""Most solids and planes of such a set, those of each body counted once more: kernels have their records in constant
memory."""


def records_of_parts(scene: Scene) -> int:
    """At most so many records has a set of several bodies: of all together, and of each body with what cuts it."""
    joins = [each.join for each in scene.joined.values()]
    added = 1 + joins.count("union")
    cuts = len(joins) + 1 - added
    named = sum(name in scene.joined for plane in scene.cut_planes for name in plane.cut_objects)
    return 2 * added + (1 + min(added, len(scene.materials) + 1)) * (cuts + named)
