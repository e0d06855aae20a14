"""The same picture told from another place: scenes go over to `deep` as the camera comes near, and back.

A scene's point p is the point c + p / m of the formula's space, c and m being `deep.center` and `deep.magnification`.
Told from c' and m' it is (p / m + c - c') m', which is made of fractions and rounded once. Cameras are all that is told
anew: what else has a place or a length in scene units keeps a scene from going over by itself (`why_it_stays`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from math import ceil, dist, hypot, log10
from typing import TypeAlias, cast

from clfractal.elements.lights.directional import DirectionalLight
from clfractal.errors import ClfractalError
from clfractal.scene.deep import LARGEST_MAGNIFICATION, Deep
from clfractal.scene.model import Scene
from clfractal.scene.parts import AnyCamera, OrthographicCamera, PerspectiveCamera
from clfractal.scene.surface import SurfaceRenderer
from clfractal.schema.base import Vector, dot, length, minus, unit

Exact: TypeAlias = tuple[Fraction, Fraction, Fraction]

STANDS = 3.0
"""So far a camera stands from what it looks at, scene units, where a place is shown magnified."""
BEGINS = 1e-4
"""A camera that is nearer to what it looks at, parts of the formula's radius, has its scene go over to `deep`."""
ENDS = 1e-2
"""One that is farther away has it go back."""
# Within these distances the magnification stays, so that not each step of a zoom begins orbits anew.
_NEAREST, _FARTHEST = STANDS / 4, STANDS * 4
# How far a place may be from what is looked at, scene units: points far from it begin their orbits earlier.
_REACH, _PAST_REACH = 6.0, 40.0
# What is farther aside, as the cosine of an angle, tells nothing of how far one looks.
_ASIDE = 0.2
# Digits of a centre beyond those of one scene unit.
_DIGITS = 22
# What else has places and lengths in scene units, by what tells that it is there.
_TOLD_IN_SCENE_UNITS: Mapping[str, Callable[[Scene], bool]] = {
    "fog": lambda scene: scene.fog is not None,
    "glow": lambda scene: scene.glow is not None,
    "mist": lambda scene: scene.mist is not None,
    "objects": lambda scene: bool(scene.objects),
    "cut_planes": lambda scene: bool(scene.cut_planes),
    "layout": lambda scene: scene.layout is not None,
    "lights": lambda scene: not all(type(light) is DirectionalLight for light in scene.lights),
    "renderer.bounds": lambda scene: getattr(scene.renderer, "bounds", None) is not None,
    "renderer.step": lambda scene: getattr(scene.renderer, "step", None) is not None,
    "stereo.plane": lambda scene: scene.stereo is not None and scene.stereo.plane is not None,
    "camera.f_number": lambda scene: getattr(scene.camera, "f_number", None) is not None,
}
_SPACE: Exact = (Fraction(0), Fraction(0), Fraction(0))


def exact_center(deep: Deep | None) -> Exact:
    """The centre of a scene's space in that of its formula."""
    return _SPACE if deep is None else cast(Exact, tuple(map(Fraction, deep.center)))


def magnification_of(deep: Deep | None) -> float:
    """How many scene units one unit of the formula's space is."""
    return 1.0 if deep is None else deep.magnification


def exact_point(point: Vector, deep: Deep | None) -> Exact:
    """The point of the formula's space that a point of a scene is."""
    magnification = Fraction(magnification_of(deep))
    found = (
        center + Fraction(each) / magnification
        for each, center in zip(point, exact_center(deep), strict=True)
    )
    return cast(Exact, tuple(found))


def seen_point(point: Exact, deep: Deep | None) -> Vector:
    """Where a scene has a point of the formula's space, rounded once."""
    return cast(Vector, tuple(map(float, point))) if deep is None else deep.place(0).seen(point)


def told_anew(point: Vector, before: Deep | None, after: Deep | None) -> Vector:
    """A point of a scene as the scene has it where another place is shown."""
    if before == after:
        return point
    return seen_point(exact_point(point, before), after)


def decimal_text(number: Fraction, places: int) -> str:
    """A number as decimal text, rounded to so many places behind the point, without zeros at its end."""
    digits = str(abs(round(number * 10**places))).rjust(places + 1, "0")
    whole, part = digits[: len(digits) - places], digits[len(digits) - places :].rstrip("0")
    sign = "-" if number < 0 and (part or whole.strip("0")) else ""
    return f"{sign}{whole}.{part}" if part else f"{sign}{whole}"


def decimal_places(magnification: float) -> int:
    """Digits behind the point that a centre needs which is so much magnified."""
    return max(ceil(log10(magnification)), 0) + _DIGITS


def deep_at(center: Exact, magnification: float) -> Deep:
    """The place, with as many digits as it needs."""
    places = decimal_places(magnification)
    return Deep.checked(
        {
            "center": tuple(decimal_text(each, places) for each in center),
            "magnification": float(magnification),
        }
    )


def rebased(scene: Scene, deep: Deep | None) -> Scene:
    """The scene with another place, and its camera where it was: the picture stays.

    Raises:
        SceneError: the camera would be out of the range of coordinates.
    """
    camera = camera_told_anew(scene.camera, scene.deep, deep)
    return scene.model_copy(update={"deep": deep, "camera": camera})


def camera_told_anew(camera: AnyCamera, before: Deep | None, after: Deep | None) -> AnyCamera:
    """A camera of a scene as the scene has it where another place is shown.

    Raises:
        SceneError: it would be out of the range of coordinates.
    """
    if before == after:
        return camera
    factor = magnification_of(after) / magnification_of(before)
    update: dict[str, object] = {
        "position": told_anew(camera.position, before, after),
        "target": told_anew(camera.target, before, after),
    }
    if isinstance(camera, OrthographicCamera):
        update["height"] = camera.height * factor
    elif camera.focus_distance is not None:
        update["focus_distance"] = camera.focus_distance * factor
    return camera.model_copy(update=update)


def magnified(scene: Scene) -> float:
    """How many times larger the picture shows what it looks at than from `STANDS` units of the formula's space."""
    camera = scene.camera
    across = dist(camera.position, camera.target)
    if isinstance(camera, OrthographicCamera):
        across = camera.height
    return magnification_of(scene.deep) * STANDS / across


def settled(scene: Scene, toward: Vector | None = None) -> Scene:
    """The scene as it is told best after its camera has moved: the picture is the same, its numbers have digits to spare.

    Args:
        toward: the point that the camera comes nearer to, scene units: it says how far what is looked at is, and a place
            begins best there; None: the target.

    A scene that is well told, or that has to stay (`why_it_stays`), is given back itself.
    """
    if not is_far_off(scene, toward) or why_it_stays(scene):
        return scene
    try:
        aimed = scene.model_copy(update={"camera": _aimed(scene.camera, toward)})
        return rebased(aimed, _place_for(aimed, toward))
    except ClfractalError:  # a camera far beside all that can be shown
        return scene


def why_it_stays(scene: Scene) -> str:
    """Why a scene does not go over to another place by itself, as one line; empty: it does."""
    if not isinstance(scene.renderer, SurfaceRenderer):
        return "a place is shown deeper by the surface renderer alone"
    if not isinstance(scene.camera, PerspectiveCamera):
        return "a place is shown deeper by a perspective camera alone"
    if scene.chain.alone:
        return "there is no formula to look deeper into"
    if scene.animation is not None and scene.deep is None:
        return "a film zooms deeper once its scene has a place: switch it on in the panel Place"
    for path, there in _TOLD_IN_SCENE_UNITS.items():
        if there(scene):
            return f"this scene is not shown deeper by itself: {path} would have to move along"
    return ""


def is_far_off(scene: Scene, toward: Vector | None = None) -> bool:
    """Whether the camera is so near to what it looks at, or so far from it, that another place tells the scene better.

    Args:
        toward: as for `settled`.
    """
    camera, deep = _aimed(scene.camera, toward), scene.deep
    distance = dist(camera.position, camera.target)
    if deep is None:
        return distance < BEGINS * scene.chain.own_radius
    away = hypot(*camera.target)
    if _goes_back(scene, distance):
        return True
    if away > _PAST_REACH * max(distance / STANDS, 1.0):
        return True
    wanted = _magnification_for(deep, distance)
    return not _NEAREST <= distance <= _FARTHEST and wanted != deep.magnification


def _aimed(camera: AnyCamera, toward: Vector | None) -> AnyCamera:
    """The camera with a target as far away as a point that it comes nearer to; the picture stays."""
    if toward is None:
        return camera
    axis, way = unit(camera.ahead), minus(toward, camera.position)
    depth = dot(way, axis)
    if not depth > _ASIDE * length(way):
        return camera
    x, y, z = (start + depth * along for start, along in zip(camera.position, axis, strict=True))
    try:
        return camera.model_copy(update={"target": (x, y, z)})
    except ClfractalError:  # too near for the camera's coordinates
        return camera


def _goes_back(scene: Scene, distance: float) -> bool:
    far = distance > ENDS * scene.chain.own_radius * magnification_of(scene.deep)
    return far and scene.animation is None


def _magnification_for(deep: Deep | None, distance: float) -> float:
    wanted = magnification_of(deep) * STANDS / distance
    return min(max(wanted, 1.0), LARGEST_MAGNIFICATION)


def _place_for(scene: Scene, toward: Vector | None) -> Deep | None:
    camera, deep = scene.camera, scene.deep
    distance = dist(camera.position, camera.target)
    if deep is not None and _goes_back(scene, distance):
        return None
    magnification = deep.magnification if deep is not None else 1.0
    if deep is None or not _NEAREST <= distance <= _FARTHEST:
        magnification = _magnification_for(deep, distance)
    # (What is far away in the picture is no place to begin at.)
    near = toward is not None and dist(toward, camera.position) <= _REACH / STANDS * distance
    focus = toward if toward is not None and near else camera.target
    grown = magnification / magnification_of(deep)
    if deep is not None and hypot(*focus) * grown <= _REACH:
        return deep.model_copy(update={"magnification": magnification})
    return deep_at(exact_point(focus, deep), magnification)
