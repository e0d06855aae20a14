"""Between pixels of a view's picture and points of space.

A place in the picture is (x, y) in pixels from its upper left corner, y down; pixel (i, j) has its middle at
(i + 0.5, j + 0.5). Depth is the channel Z: the distance along the view's axis from its origin.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View
from clfractal.schema.base import Vector

Floats: TypeAlias = npt.NDArray[np.float64]
Size: TypeAlias = tuple[int, int]


def vector(values: Floats) -> Vector:
    """Three coordinates as a scene has them."""
    x, y, z = values.tolist()
    return x, y, z


def ray_at(view: View, x: float, y: float, size: Size) -> tuple[Floats, Floats]:
    """The ray through a place of the picture: its origin (the eye, or a point of the plane) and its unit direction."""
    width, height = size
    on_plane = (
        view.center
        + view.side * ((x - width / 2) * view.width / width)
        - view.up * ((y - height / 2) * view.height / height)
    )
    if view.eye is None:
        return on_plane, view.axis
    direction = on_plane - view.eye
    return view.eye, direction / np.linalg.norm(direction)


def point_at(view: View, x: float, y: float, size: Size, depth: float) -> Floats:
    """The point, shape (3,), that a place of the picture shows at a finite depth."""
    origin, direction = ray_at(view, x, y, size)
    along = depth - (origin - view.origin) @ view.axis
    return origin + direction * (along / (direction @ view.axis))


def project(view: View, point: npt.ArrayLike, size: Size) -> tuple[float, float, float]:
    """Where the picture shows a point: x, y and its depth. x and y are NaN for points beside or behind the eye."""
    place = np.asarray(point, float)
    depth = float((place - view.origin) @ view.axis)
    on_plane = place - view.center
    if view.eye is not None:
        offset = place - view.eye
        ahead = float(offset @ view.axis)
        if not ahead > 0:
            return float("nan"), float("nan"), depth
        distance = float((view.center - view.eye) @ view.axis)
        on_plane = view.eye - view.center + offset * (distance / ahead)
    width, height = size
    x = width / 2 + float(on_plane @ view.side) * width / view.width
    y = height / 2 - float(on_plane @ view.up) * height / view.height
    return x, y, depth
