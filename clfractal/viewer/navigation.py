"""Moves of a camera by a pointer: orbit, pan, zoom, roll.

Every move returns a valid camera: one that would leave the range of coordinates, or that is not finite, returns the
camera unchanged. Places are in pixels (see `pointer`), lengths in scene units, angles of arguments in degrees.
"""

from __future__ import annotations

from math import isfinite

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View, camera_view
from clfractal.scene.parts import AnyCamera, OrthographicCamera
from clfractal.viewer.pointer import Size, point_at, project, ray_at
from clfractal.viewer.pose import C, Style, pose_of, rotation, stood, turned_about, turning
from clfractal.viewer.standard_views import axis_view, frame_all, to_orthographic, to_perspective
from clfractal.viewer.transition import interpolated

__all__ = [
    "axis_view",
    "center_on",
    "dolly",
    "frame_all",
    "interpolated",
    "levelled",
    "orbit",
    "pan",
    "point_at",
    "project",
    "ray_at",
    "roll",
    "to_orthographic",
    "to_perspective",
    "used_depth",
    "zoom_to",
]

# A drag across the picture's smaller side turns by half a turn.
_DRAG_ANGLE = np.pi
# How near an orthographic camera's target may be, parts of its old distance and of the picture's height.
_NEAREST_TARGET = 0.1


def used_depth(camera: AnyCamera, depth: float, view: View | None = None) -> float:
    """A pixel's depth, or that of the target where the pixel shows nothing (infinite or not positive)."""
    if isfinite(depth) and depth > 0:
        return depth
    if view is not None and view.eye is not None:
        return float((view.center - view.origin) @ view.axis)
    return pose_of(camera).distance


@np.errstate(all="ignore")
def orbit(
    camera: C,
    pivot: npt.ArrayLike,
    dx: float,
    dy: float,
    size: Size,
    style: Style = "turntable",
    *,
    vertical: npt.ArrayLike | None = None,
) -> C:
    """The camera, turned about `pivot` so that what is in front of it follows a drag by (dx, dy) pixels.

    The pivot keeps its pixel and its depth.

    Args:
        vertical: axis of the turntable, which a level picture has upwards; None: the camera's `up`.
    """
    if not (isfinite(dx) and isfinite(dy)):
        return camera
    scale = _DRAG_ANGLE / min(size)
    axis = camera.up if vertical is None else vertical
    matrix, up = turning(pose_of(camera), style, dx * scale, dy * scale, axis)
    return turned_about(camera, pivot, matrix, up)


@np.errstate(all="ignore")
def pan(camera: C, dx: float, dy: float, size: Size, depth: float, *, view: View | None = None) -> C:
    """The camera, shifted in its plane so that points at `depth` follow a drag by (dx, dy) pixels.

    Args:
        depth: of the point under the pointer; infinite: the target's.
        view: what is shown of the camera, if not what it sees itself (of a stereo pair: the cyclopean eye's view).
    """
    shown = view or camera_view(camera, *size)
    width, height = size
    scale = 1.0
    if shown.eye is not None:
        ahead = used_depth(camera, depth, shown) - float((shown.eye - shown.origin) @ shown.axis)
        scale = ahead / float((shown.center - shown.eye) @ shown.axis)
    shift = scale * (shown.up * (dy * shown.height / height) - shown.side * (dx * shown.width / width))
    pose = pose_of(camera)
    return stood(camera, pose.position + shift, pose.target + shift)


@np.errstate(all="ignore")
def dolly(camera: C, factor: float, toward: npt.ArrayLike | None = None) -> C:
    """The camera, nearer to a point (below 1) or farther away by a factor; the point keeps its pixel.

    Of an orthographic camera the height is scaled instead, and its plane stays where it is, so that it cuts nothing
    off. The target's distance from the point is scaled alike.

    Args:
        factor: above 0; any other number moves nothing.
        toward: the point; None: the target.
    """
    if not (isfinite(factor) and factor > 0):
        return camera
    pose = pose_of(camera)
    point = pose.target if toward is None else np.asarray(toward, float)
    # By steps from where things are, which keeps the digits of a small one.
    nearer = factor - 1
    position = pose.position + nearer * (pose.position - point)
    target = pose.target + nearer * (pose.target - point)
    if not isinstance(camera, OrthographicCamera):
        return stood(camera, position, target)
    ahead = float((target - pose.position) @ pose.axis)
    position = position - pose.axis * float((position - pose.position) @ pose.axis)
    height = camera.height * factor
    distance = ahead if ahead >= _NEAREST_TARGET * max(pose.distance, height) else pose.distance
    return stood(camera, position, position + pose.axis * distance, height=height)


@np.errstate(all="ignore")
def zoom_to(
    camera: C, x: float, y: float, size: Size, factor: float, depth: float, *, view: View | None = None
) -> C:
    """As `dolly`, towards the point that is `depth` under the pointer, which stays there.

    Args:
        depth: infinite: the target's.
        view: as for `pan`.
    """
    shown = view or camera_view(camera, *size)
    return dolly(camera, factor, point_at(shown, x, y, size, used_depth(camera, depth, shown)))


@np.errstate(all="ignore")
def center_on(camera: C, point: npt.ArrayLike) -> C:
    """The camera, shifted in its plane so that a point is in the middle; it is the new target.

    A point that is not in front of the camera keeps the distance of the old target.
    """
    pose, middle = pose_of(camera), np.asarray(point, float)
    ahead = float((middle - pose.position) @ pose.axis)
    shown = stood(camera, middle - ahead * pose.axis, middle) if ahead > 0 else camera
    return shown if shown is not camera else stood(camera, middle - pose.distance * pose.axis, middle)


@np.errstate(all="ignore")
def roll(camera: C, degrees: float) -> C:
    """The camera, turned clockwise about its axis, so that the picture turns anticlockwise."""
    if not isfinite(degrees):
        return camera
    pose = pose_of(camera)
    up = rotation(pose.axis, np.radians(np.fmod(degrees, 360.0))) @ pose.up
    return stood(camera, pose.position, pose.target, up)


def levelled(camera: C, vertical: npt.ArrayLike = (0.0, 0.0, 1.0)) -> C:
    """The camera with `vertical` upwards in its picture; unchanged where it looks along it."""
    return stood(camera, camera.position, camera.target, vertical)
