"""Where a camera stands and how it is turned, and cameras made of that again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, TypeVar, cast

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import camera_view
from clfractal.errors import SceneError
from clfractal.scene.parts import AnyCamera, OrthographicCamera, PerspectiveCamera
from clfractal.scene.stance import LARGEST, NEAREST
from clfractal.viewer.pointer import Floats

C = TypeVar("C", bound=PerspectiveCamera | OrthographicCamera)
Style: TypeAlias = Literal["turntable", "free"]

# A turntable stops before the poles, where its horizon would vanish.
POLE_LIMIT = np.radians(89.9)
_LEVEL = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A camera's place and attitude.

    Attributes:
        position, target: shape (3,), scene units.
        side, up, axis: unit vectors to the picture's right, to its top, and in the direction of view.
        distance: from position to target, scene units.
    """

    position: Floats
    target: Floats
    side: Floats
    up: Floats
    axis: Floats
    distance: float


def pose_of(camera: AnyCamera) -> Pose:
    """The pose of a camera; its vectors are the ones of `camera_view`."""
    view = camera_view(camera, 1, 1)
    position, target = np.array(camera.position, float), np.array(camera.target, float)
    return Pose(position, target, view.side, view.up, view.axis, float(np.linalg.norm(target - position)))


def stood(
    camera: C,
    position: npt.ArrayLike,
    target: npt.ArrayLike,
    up: npt.ArrayLike | None = None,
    **changes: object,
) -> C:
    """The camera at another place; the camera itself where no camera can be there.

    A move is refused that leaves the range of coordinates, that is not finite, or that brings the target so near that
    the direction of view would be rounded away.
    """
    place, aim = np.asarray(position, float), np.asarray(target, float)
    if not (np.all(np.abs(place) <= LARGEST) and np.all(np.abs(aim) <= LARGEST)):
        return camera
    # A scene may begin with a target that is too near; such a camera can still be turned, and moved away.
    distance = float(np.linalg.norm(aim - place))
    least = NEAREST * max(float(np.abs(place).max()), float(np.abs(aim).max()))
    if distance < least and distance < 0.999 * pose_of(camera).distance:
        return camera
    update: dict[str, object] = {"position": tuple(place.tolist()), "target": tuple(aim.tolist()), **changes}
    if up is not None:
        update["up"] = tuple(np.asarray(up, float).tolist())
    try:
        return cast(C, camera.model_copy(update=update))
    except SceneError:
        return camera


def rotation(axis: npt.ArrayLike, angle: float) -> Floats:
    """The matrix, for column vectors, of a rotation about a unit vector by the right-hand rule; radians."""
    x, y, z = np.asarray(axis, float)
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # 1 - cos as a square keeps its digits at small angles.
    return cast(Floats, np.eye(3) + np.sin(angle) * across + 2 * np.sin(angle / 2) ** 2 * (across @ across))


def turned_about(camera: C, pivot: npt.ArrayLike, matrix: Floats, up: npt.ArrayLike) -> C:
    """The camera and its target, turned about a point by a rotation; `up` is the new camera's."""
    pose, middle = pose_of(camera), np.asarray(pivot, float)
    position = middle + matrix @ (pose.position - middle)
    target = middle + matrix @ (pose.target - middle)
    return stood(camera, position, target, up)


def turning(
    pose: Pose, style: Style, right: float, down: float, vertical: npt.ArrayLike
) -> tuple[Floats, Floats]:
    """The rotation of a camera whose picture follows a drag to the right and down, and the new camera's `up`.

    Args:
        style: `turntable` turns about `vertical` and tips about the horizontal, and stops before the poles; a level
            picture stays level, and a rolled one keeps its roll. `free` turns about the picture's own axes.
        right, down: angles of the drag, radians.
        vertical: the direction of the turntable's axis; any length but 0.
    """
    if style == "free":
        turn = -(right * pose.up + down * pose.side)
        angle = float(np.linalg.norm(turn))
        matrix = rotation(turn / angle, angle) if angle > 0 else np.eye(3)
        return matrix, matrix @ pose.up
    pole = np.asarray(vertical, float)
    pole = pole / np.linalg.norm(pole)
    horizontal = np.cross(pose.axis, pole)
    across = float(np.linalg.norm(horizontal))
    horizontal = horizontal / across if across > _LEVEL else pose.side
    # In a picture that is upside down, left and right of the turntable have changed places, too.
    sense = 1.0 if pose.up @ pole > -_LEVEL else -1.0
    now = float(np.arctan2(pose.axis @ pole, across))
    then = float(np.clip(now - sense * down, min(now, -POLE_LIMIT), max(now, POLE_LIMIT)))
    matrix = rotation(pole, -sense * right) @ rotation(horizontal, then - now)
    level = abs(then) <= POLE_LIMIT + _LEVEL and abs(float(pose.side @ pole)) <= _LEVEL and sense > 0
    # As it was given, so that a saved scene keeps its words.
    return matrix, np.asarray(vertical, float) if level else matrix @ pose.up
