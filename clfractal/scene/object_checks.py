"""Checks of a scene's objects: their materials, lights in them, and what cannot show them."""

from clfractal.errors import SceneError, Where, unknown_name
from clfractal.scene.blends import is_glass
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.lighting import PlacedLight, RectangleLight, SphereLight
from clfractal.scene.maps import maps_of
from clfractal.scene.model import Scene
from clfractal.scene.objects import MAX_FORMULAS, FormulaObject, Level, PlaneObject, Solid, WaterObject
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer


def check_objects(scene: Scene) -> None:
    """Raises SceneError, with a dotted path, for objects that cannot be shown."""
    _check_named(scene)
    if not scene.objects:
        return
    if not isinstance(scene.renderer, SurfaceRenderer):
        _check_filled(scene, scene.renderer)
    _check_joined(scene)
    for name, each in scene.objects.items():
        _check_material(scene, name, each.material)
        if isinstance(each, Solid) and each.join in ("union", "smooth_union"):
            _check_lights(scene, name, each)


def can_show(renderer: str, kind: str) -> bool:
    """Whether a type of renderer shows objects of a type."""
    return renderer == "surface" or kind != "water"


def _check_named(scene: Scene) -> None:
    """What planes name can be cut as parts of the set."""
    for number, plane in enumerate(scene.cut_planes):
        for place, name in enumerate(plane.objects):
            where = Where(path=f"cut_planes.{number}.objects.{place}")
            if name not in scene.objects:
                raise SceneError(unknown_name("object", name, tuple(scene.objects)), where)
            each = scene.objects[name]
            if isinstance(each, Level):
                raise SceneError(
                    f"{name!r} cannot be cut: a {each.type} surface has no end; a flat box can", where
                )


def _check_filled(scene: Scene, renderer: VolumeRenderer | CutPlaneRenderer) -> None:
    """What cannot be filled into voxels, or has no counts on a plane."""
    if isinstance(renderer, VolumeRenderer) and renderer.file is not None:
        raise SceneError("are not joined to a grid from a file; remove them", Where(path="objects"))
    for name, each in scene.objects.items():
        if isinstance(each, WaterObject):
            raise SceneError(
                f"cannot be water with renderer {renderer.type}: its waves have no end; {{type: plane}} can",
                Where(path=f"objects.{name}.type"),
            )


def _check_joined(scene: Scene) -> None:
    """What cannot be joined to the set, and what the set cannot have then."""
    if not scene.joined:
        return
    names = [name for name, each in scene.joined.items() if isinstance(each, FormulaObject)]
    if len(names) > MAX_FORMULAS:
        raise SceneError(
            f"at most {MAX_FORMULAS} objects can be formulas, and this is one more",
            Where(path=f"objects.{names[MAX_FORMULAS]}.type"),
        )
    for name, each in scene.joined.items():
        where = Where(path=f"objects.{name}.join")
        if isinstance(each, PlaneObject) and each.join == "smooth_union":
            raise SceneError("cannot be smooth_union for a plane, which has no end; a flat box can", where)


def _lets_through(scene: Scene, material: str | None) -> bool:
    """Whether a material is glass along paths."""
    if material is None or not isinstance(scene.lighting, PathLighting):
        return False
    return is_glass(scene.materials[material], scene.materials)


def _check_material(scene: Scene, name: str, material: str | None) -> None:
    where = Where(path=f"objects.{name}.material")
    if material is None or material in scene.materials:
        _check_kind(scene, name, material, where)
        return
    if not scene.materials:
        raise SceneError(f"names {material!r}, but the scene has no materials", where)
    raise SceneError(unknown_name("material", material, tuple(scene.materials)), where)


def _check_kind(scene: Scene, name: str, material: str | None, where: Where) -> None:
    """What is joined is glass as a whole or not; what differs from place to place is for paths; only surfaces have it."""
    if not isinstance(scene.renderer, SurfaceRenderer):
        return
    used = material if material is not None else scene.material.name
    if used is None:
        return
    own = scene.material.name
    if name in scene.joined and used != own:
        if _lets_through(scene, used):
            raise SceneError(
                f"{used!r} is glass, which formulas and what is joined can be only with all of the set",
                where,
            )
        if own in scene.materials and _lets_through(scene, own):
            raise SceneError(f"{used!r} is not the glass of the set, {own!r}, to which it is joined", where)
    if isinstance(scene.lighting, PathLighting) or material is None:
        return
    if scene.materials[used].blend is not None or any(maps_of(scene.materials[used])):
        raise SceneError(f"{used!r} differs from place to place, which needs lighting.mode: path", where)


def _check_lights(scene: Scene, name: str, solid: Solid) -> None:
    """A light in a solid reaches nothing, but where the eye is in it too: then it is a room."""
    if solid.holds(scene.camera.position):
        return
    glass = _lets_through(scene, solid.material or scene.material.name)
    for index, light in enumerate(scene.lights):
        if glass and isinstance(light, (SphereLight, RectangleLight)):
            continue  # paths find it, since it has a size
        if isinstance(light, PlacedLight) and solid.holds(light.position):
            shown = ", ".join(f"{x:g}" for x in light.position)
            raise SceneError(
                f"must be outside the object {name!r}, where its light reaches something, got [{shown}]",
                Where(path=f"lights.{index}.position"),
            )
