"""Checks of a scene's objects: their materials, lights in them, and what cannot show them."""

from clfractal.errors import SceneError, Where, unknown_name
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.lighting import PlacedLight
from clfractal.scene.maps import Map, maps_of
from clfractal.scene.model import Scene
from clfractal.scene.objects import Solid
from clfractal.scene.surface import SurfaceRenderer


def check_objects(scene: Scene) -> None:
    """Raises SceneError, with a dotted path, for objects that cannot be shown."""
    if not scene.objects:
        return
    if not isinstance(scene.renderer, SurfaceRenderer):
        raise SceneError(
            f"are shown by renderer surface, not by {scene.renderer.type}; remove them", Where(path="objects")
        )
    for name, each in scene.objects.items():
        _check_material(scene, each.material, Where(path=f"objects.{name}.material"))
        if isinstance(each, Solid):
            _check_lights(scene, name, each)


def _check_material(scene: Scene, material: str | None, where: Where) -> None:
    if material is None or material in scene.materials:
        _check_kind(scene, material, where)
        return
    if not scene.materials:
        raise SceneError(f"names {material!r}, but the scene has no materials", where)
    raise SceneError(unknown_name("material", material, tuple(scene.materials)), where)


def _check_kind(scene: Scene, name: str | None, where: Where) -> None:
    """Glass is for the set, and what differs from place to place is for paths."""
    path = isinstance(scene.lighting, PathLighting)
    used = name if name is not None else scene.material.name
    if used is None:
        return
    material = scene.materials[used]
    weight = material.transmission.weight
    if path and (isinstance(weight, Map) or weight > 0):
        raise SceneError(f"{used!r} has transmission, which objects cannot have", where)
    if not path and name is not None and (material.blend is not None or any(maps_of(material))):
        raise SceneError(f"{used!r} differs from place to place, which needs lighting.mode: path", where)


def _check_lights(scene: Scene, name: str, solid: Solid) -> None:
    """A light in a solid reaches nothing, but where the eye is in it too: then it is a room."""
    if solid.holds(scene.camera.position):
        return
    for index, light in enumerate(scene.lights):
        if isinstance(light, PlacedLight) and solid.holds(light.position):
            shown = ", ".join(f"{x:g}" for x in light.position)
            raise SceneError(
                f"must be outside the object {name!r}, where its light reaches something, got [{shown}]",
                Where(path=f"lights.{index}.position"),
            )
