"""Views that a key chooses: the six sides, all of the object, and the other projection."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from clfractal.errors import SceneError
from clfractal.scene.parts import AnyCamera, OrthographicCamera, PerspectiveCamera
from clfractal.scene.stance import LARGEST, Framed, framing, least_distance, room
from clfractal.viewer.pointer import Size, vector
from clfractal.viewer.pose import C, pose_of, stood

Side: TypeAlias = Literal["front", "back", "left", "right", "top", "bottom"]

# The direction of view and what is up, from each side. From the front one looks along y, as a new scene does.
SIDES: dict[Side, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "front": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "back": ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "left": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "right": ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "top": ((0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "bottom": ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
}
_LENS = ("f_number", "focus_distance", "focus", "focus_on", "sensor_height")
_LEAST_HEIGHT, _LEAST_FOV, _MOST_FOV = 1e-12, 1e-6, 179.9


@np.errstate(all="ignore")
def frame_all(camera: C, shown: Framed, size: Size) -> C:
    """The camera, moved without a turn so that it shows all of something, whose middle is the target; see `framing`.

    Where that is too large for the range of coordinates, the camera is as far away as it can be.
    """
    fov = camera.fov if isinstance(camera, PerspectiveCamera) else None
    pose = pose_of(camera)
    along = (vector(pose.axis), vector(pose.side), vector(pose.up))
    position, target, height = framing(along, shown, size[0] / size[1], fov)
    return stood(camera, position, target, **({} if height is None else {"height": height}))


@np.errstate(all="ignore")
def axis_view(camera: C, side: Side, size: Size, shown: Framed | None = None) -> C:
    """The camera, looking from one of the six sides.

    Args:
        shown: what it is to show (see `frame_all`); None: target and distance stay.
    """
    axis, up = (np.array(each) for each in SIDES[side])
    middle = np.array(camera.target if shown is None else shown.center, float)
    # The old `up` may lie along the new axis, so both change at once.
    turned = stood(camera, middle - pose_of(camera).distance * axis, middle, up)
    return turned if shown is None else frame_all(turned, shown, size)


@np.errstate(all="ignore")
def to_orthographic(
    camera: AnyCamera, bounds: tuple[npt.ArrayLike, float] | None = None
) -> OrthographicCamera:
    """The same view by parallel rays; what is at the target's depth keeps its size.

    Args:
        bounds: middle and radius of a ball that shall lie behind the camera's plane as a whole: the camera steps back as
            far as that needs. None: it stays where it is, and shows nothing of what is beside or behind it.
    """
    if isinstance(camera, OrthographicCamera):
        return camera
    pose = pose_of(camera)
    height = 2 * pose.distance * float(np.tan(np.radians(camera.fov) / 2))
    position = pose.position
    if bounds is not None:
        nearest = float((np.asarray(bounds[0], float) - position) @ pose.axis) - bounds[1]
        back = min(max(-nearest, 0.0), room(position, -pose.axis))
        position = position - back * pose.axis if np.isfinite(back) else position
    height = float(np.clip(height, _LEAST_HEIGHT, LARGEST))
    try:
        return OrthographicCamera(
            position=vector(position), target=camera.target, up=camera.up, height=height
        )
    except SceneError:  # `up` was nearly along the view, and is so now
        return OrthographicCamera(
            position=vector(position), target=camera.target, up=vector(pose.up), height=height
        )


@np.errstate(all="ignore")
def to_perspective(
    camera: AnyCamera, fov: float = 45.0, like: PerspectiveCamera | None = None
) -> PerspectiveCamera:
    """The same view from an eye; what is at the target's depth keeps its size.

    The target stays. Where the eye would be beyond the range of coordinates, the angle of view grows instead.

    Args:
        fov: vertical angle of view, degrees, unless `like` has it.
        like: a camera whose angle of view and lens are taken over, for example the one before `to_orthographic`.
    """
    if isinstance(camera, PerspectiveCamera):
        return camera
    pose = pose_of(camera)
    wanted = like.fov if like is not None else fov
    half = camera.height / 2
    # The eye may be where the camera is, so there always is room for it.
    farthest = max(room(pose.target, -pose.axis), pose.distance)
    distance = min(max(half / float(np.tan(np.radians(wanted) / 2)), least_distance(pose.target)), farthest)
    position = pose.target - distance * pose.axis
    if distance == farthest:
        position = np.clip(position, -LARGEST, LARGEST)
    used = float(np.degrees(2 * np.arctan(half / distance)))
    if abs(used - wanted) <= 1e-9 * wanted:
        used = wanted
    lens = {} if like is None else {name: getattr(like, name) for name in _LENS}
    lens["fov"] = float(np.clip(used, _LEAST_FOV, _MOST_FOV))
    try:
        return PerspectiveCamera(position=vector(position), target=camera.target, up=camera.up, **lens)
    except SceneError:  # as above
        return PerspectiveCamera(position=vector(position), target=camera.target, up=vector(pose.up), **lens)
