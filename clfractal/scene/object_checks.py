"""Checks of a scene's objects: their materials, lights in them, and what cannot show them."""

from collections.abc import Callable

from clfractal.elements.shapes.plane import PlaneObject
from clfractal.errors import SceneError, Where, unknown_name
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.glass_parts import (
    MAX_RECORDS,
    has_glass_parts,
    lets_through,
    light_goes_into,
    records_of_parts,
)
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.scene.named_files import volumes_of
from clfractal.scene.objects import KINDS, MAX_FORMULAS, MAX_VOLUMES, FormulaObject, VolumeObject, WaterObject
from clfractal.scene.renderer import RENDERERS
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer
from clfractal.schema.base import Vector
from clfractal.schema.light import LightBase
from clfractal.schema.mapped import maps_of
from clfractal.schema.shape import Level, Solid


def check_objects(scene: Scene) -> None:
    """Raises SceneError, with a dotted path, for objects that cannot be shown."""
    _check_named(scene)
    _check_faces(scene)
    if not scene.objects:
        return
    if not isinstance(scene.renderer, SurfaceRenderer):
        _check_filled(scene, scene.renderer)
    _check_joined(scene)
    _check_volumes(scene)
    _check_glass_parts(scene)
    for name, each in scene.objects.items():
        check_material(scene, each.material, f"objects.{name}.material")
        _check_kind(scene, name, each.material, Where(path=f"objects.{name}.material"))
        if isinstance(each, Solid) and each.join in ("union", "smooth_union"):
            _check_lights(scene, name, each)


def can_show(renderer: str, kind: str) -> bool:
    """Whether a type of renderer shows objects of a type."""
    return RENDERERS[renderer].shows_every_object or not any(
        each.of_rays for each in KINDS if each.tag == kind
    )


MAX_OPENINGS = 32
"""How often parts of the set may be cut by planes alone: of each the kernels have a record in constant memory."""


def _check_named(scene: Scene) -> None:
    """What planes name can be cut, each for itself or with the set."""
    openings = 0
    for number, plane in enumerate(scene.cut_planes):
        if not plane.set and not isinstance(scene.renderer, SurfaceRenderer):
            raise SceneError(
                "is for surface renderers: in a volume all that there is belongs to the set; remove it",
                Where(path=f"cut_planes.{number}.set"),
            )
        for place, name in enumerate(plane.objects):
            where = Where(path=f"cut_planes.{number}.objects.{place}")
            if name not in scene.objects:
                raise SceneError(unknown_name("object", name, tuple(scene.objects)), where)
            each = scene.objects[name]
            if isinstance(each, Level):
                raise SceneError(
                    f"{name!r} cannot be cut: a {each.tag} surface has no end; a flat box can", where
                )
            if isinstance(each, VolumeObject):
                raise SceneError(f"{name!r} cannot be cut: it is a volume, which no plane opens", where)
            openings += int(plane.cut and not plane.set and name in scene.joined)
            if openings > MAX_OPENINGS:
                raise SceneError(
                    f"at most {MAX_OPENINGS} cuts of the set's parts, and this is one more", where
                )


def _check_faces(scene: Scene) -> None:
    """Faces may have materials along paths, which are no bodies by themselves."""
    for number, plane in enumerate(scene.cut_planes):
        path = f"cut_planes.{number}.material"
        if plane.material is None:
            continue
        check_material(scene, plane.material, path)
        if inside := light_goes_into(scene, plane.material):
            raise SceneError(
                f"{plane.material!r} is {inside}, and a face is that only where what is cut is; name another material,"
                " or none",
                Where(path=path),
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
        if isinstance(each, VolumeObject):
            raise SceneError(
                f"cannot be volume with renderer {renderer.type}: its values are in a file, not in a formula; use the"
                " surface renderer",
                Where(path=f"objects.{name}.type"),
            )


def _check_volumes(scene: Scene) -> None:
    """How many there may be, and what clouds need."""
    volumes = volumes_of(scene.objects)
    if len(volumes) > MAX_VOLUMES:
        raise SceneError(
            f"at most {MAX_VOLUMES} objects can be volumes, and this is one more",
            Where(path=f"objects.{list(volumes)[MAX_VOLUMES]}.type"),
        )
    for name, each in volumes.items():
        if not each.is_cloud:
            continue
        if not isinstance(scene.lighting, PathLighting):
            raise SceneError(
                "makes a cloud, which needs lighting.mode: path; without it a surface at `level` is shown",
                Where(path=f"objects.{name}.transfer.opacity"),
            )
        if scene.fog is not None and scene.fog.scattering is not None:
            raise SceneError(
                f"cannot be combined with a cloud, objects.{name}; remove it, and the fog has its colour alone",
                Where(path="fog.scattering"),
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
        if isinstance(each, FormulaObject) and scene.joined_chains[name].alone:
            title = scene.joined_chains[name].first.formula.name
            where = Where(path=f"objects.{name}.formula.{next(iter(each.formula.mapping()))}")
            raise SceneError(f"{title} is for the scene's own formula; remove this object", where)
        where = Where(path=f"objects.{name}.join")
        if isinstance(each, PlaneObject) and each.join == "smooth_union":
            raise SceneError("cannot be smooth_union for a plane, which has no end; a flat box can", where)


def check_material(scene: Scene, name: str | None, path: str) -> None:
    """Raises SceneError, at a path, for the name of a material that is not there."""
    if name is None or name in scene.materials:
        return
    if not scene.materials:
        raise SceneError(f"names {name!r}, but the scene has no materials", Where(path=path))
    raise SceneError(unknown_name("material", name, tuple(scene.materials)), Where(path=path))


def _check_kind(scene: Scene, name: str, material: str | None, where: Where) -> None:
    """What is joined is glass as a whole or not; what differs from place to place is for paths; only surfaces have it."""
    if not isinstance(scene.renderer, SurfaceRenderer):
        return
    used = material if material is not None else scene.material.name
    each = scene.objects[name]
    if used is None or (isinstance(each, VolumeObject) and each.is_cloud):
        return
    if isinstance(each, VolumeObject) and (inside := light_goes_into(scene, used)):
        raise SceneError(f"{used!r} is {inside}, which volumes cannot be; name another material", where)
    if name in scene.joined:
        _check_joined_kind(scene, name, used, where)
    if isinstance(scene.lighting, PathLighting) or material is None:
        return
    if scene.materials[used].blend is not None or any(maps_of(scene.materials[used])):
        raise SceneError(f"{used!r} differs from place to place, which needs lighting.mode: path", where)


def _check_joined_kind(scene: Scene, name: str, used: str, where: Where) -> None:
    """Formulas beside the set's may be of glass or not, each for itself; what flows or cuts is of what it is joined to."""
    own, join = scene.material.name, scene.joined[name].join
    if join == "union" or used == own:
        return
    if lets_through(scene, used):
        raise SceneError(
            f"{used!r} is glass, which what is joined by {join} can be only with all of the set", where
        )
    if own in scene.materials and lets_through(scene, own):
        raise SceneError(f"{used!r} is not the glass of the set, {own!r}, to which it is joined", where)


def _check_glass_parts(scene: Scene) -> None:
    """What a set cannot have of which some parts are glass and others not, or another glass."""
    if not has_glass_parts(scene):
        return
    for name, each in scene.joined.items():
        if each.join == "smooth_union":
            raise SceneError(
                "cannot be smooth_union where some formulas are of glass and others not: name one material for all",
                Where(path=f"objects.{name}.join"),
            )
        if each.join != "union" and each.material is not None:
            raise SceneError(
                "is that of what is cut where some formulas are of glass and others not; remove it",
                Where(path=f"objects.{name}.material"),
            )
    records = records_of_parts(scene)
    if records > MAX_RECORDS:
        raise SceneError(
            f"where some formulas are of glass and others not they have at most {MAX_RECORDS} joins and cuts, each of"
            f" these once more for each glass that it cuts; here are {records}",
            Where(path="objects"),
        )


def _check_lights(scene: Scene, name: str, solid: Solid) -> None:
    """No light in a solid reaches anything, but one that paths find, or that a cut lets out."""
    inside = light_goes_into(scene, solid.material or scene.material.name)
    opened = [plane for plane in scene.cut_planes if name in plane.cut_objects]

    def holds(point: Vector) -> bool:
        return solid.holds(point) and not any(plane.in_front(point) for plane in opened)

    if not solid.holds(scene.camera.position):
        # (What is seen has a size, so that paths find it.)
        refuse_lights(scene, name, holds, lambda light: bool(inside) and light.is_seen)


def refuse_lights(
    scene: Scene,
    name: str,
    holds: Callable[[Vector], bool],
    reaches: Callable[[LightBase], bool] = lambda light: False,
) -> None:
    """Raises SceneError for a light within an object that reaches nothing.

    Args:
        holds: whether a point is in the object.
        reaches: whether a light does all the same.
    """
    for index, light in enumerate(scene.lights):
        place = light.stands_at
        if place is not None and not reaches(light) and holds(place):
            raise inside_of(f"the object {name!r}", index, place)


def inside_of(what: str, index: int, place: Vector) -> SceneError:
    """The error of a light that stands inside of something."""
    shown = ", ".join(f"{x:g}" for x in place)
    return SceneError(
        f"must be outside {what}, where its light reaches something, got [{shown}]",
        Where(path=f"lights.{index}.position"),
    )
