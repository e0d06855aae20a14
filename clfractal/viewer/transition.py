"""Smooth transitions between two cameras, for moves that a key or a click starts."""

from __future__ import annotations

from math import exp, log, radians, tan

import numpy as np

from clfractal.scene.parts import AnyCamera, OrthographicCamera
from clfractal.viewer.pointer import Floats
from clfractal.viewer.pose import C, pose_of, rotation, stood


def eased(t: float) -> float:
    """A fraction of a move's time as a fraction of its way: it starts and ends slowly (3 t^2 - 2 t^3)."""
    t = min(max(t, 0.0), 1.0)
    return t * t * (3 - 2 * t)


@np.errstate(all="ignore")
def interpolated(a: C, b: C, t: float) -> C:
    """A camera between `a` (t <= 0) and `b` (t >= 1), both exactly at the ends.

    The attitude turns about one axis. What is shown at the target's depth grows exponentially, and the target moves
    linearly with it: a zoom to a point keeps that point in its pixel all the time. Focus and angle of view change
    exponentially as well. Cameras of different projections, and other settings of a lens, change at once.
    """
    if t <= 0:
        return a
    if t >= 1 or type(a) is not type(b):
        return b
    start, end = pose_of(a), pose_of(b)
    size_a, size_b = _shown(a, start.distance), _shown(b, end.distance)
    size = _between(size_a, size_b, t)
    # As (size - size_a) / (size_b - size_a), also for equal sizes.
    ratio = log(size_b / size_a)
    share = float(np.expm1(t * ratio) / np.expm1(ratio)) if abs(ratio) > 1e-9 else t
    target = start.target + share * (end.target - start.target)
    turn = _turn(np.stack([end.side, end.up, end.axis], 1) @ np.stack([start.side, start.up, start.axis]), t)
    axis, up = turn @ start.axis, turn @ start.up
    changes: dict[str, object] = {}
    if isinstance(b, OrthographicCamera):
        # With the target, so that the camera's plane stays where it is during a zoom.
        distance = start.distance + share * (end.distance - start.distance)
        changes["height"] = size
    else:
        assert not isinstance(a, OrthographicCamera)
        half = _between(tan(radians(a.fov) / 2), tan(radians(b.fov) / 2), t)
        distance = size / 2 / half
        changes["fov"] = float(np.degrees(2 * np.arctan(half)))
        if a.focus_distance is not None and b.focus_distance is not None:
            changes["focus_distance"] = _between(a.focus_distance, b.focus_distance, t)
    return stood(b, target - distance * axis, target, up, **changes)


def _shown(camera: AnyCamera, distance: float) -> float:
    """Height of what a camera shows at its target's depth, scene units."""
    if isinstance(camera, OrthographicCamera):
        return camera.height
    return 2 * distance * tan(radians(camera.fov) / 2)


def _between(a: float, b: float, t: float) -> float:
    return a * exp(t * log(b / a))


def _turn(matrix: Floats, t: float) -> Floats:
    """The part t of a rotation."""
    sine = (
        np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]) / 2
    )
    cosine = (float(np.trace(matrix)) - 1) / 2
    angle = float(np.arctan2(np.linalg.norm(sine), cosine))
    if cosine > -0.99:
        length = float(np.linalg.norm(sine))
        return rotation(sine / length, t * angle) if length > 0 else np.eye(3)
    # Near half a turn the sine has no digits left: (R + R^T) / 2 = cos I + (1 - cos) n n^T has the axis.
    outer = (matrix + matrix.T) / 2 - cosine * np.eye(3)
    axis = outer[:, int(np.argmax(np.diag(outer)))]
    axis = axis / np.linalg.norm(axis)
    return rotation(axis if axis @ sine >= 0 else -axis, t * angle)
