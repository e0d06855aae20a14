"""Wireframes over a picture: segments of space, cut to what the picture shows, perhaps hidden."""

from __future__ import annotations

from typing import cast

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View
from clfractal.viewer.pointer import Floats, Size

# The near plane, part of the distance from the eye to the view's plane.
NEAR = 1e-6


@np.errstate(all="ignore")
def clipped_with_depth(
    view: View, segments: npt.ArrayLike, size: Size, margin: float = 0.0
) -> tuple[Floats, Floats]:
    """Segments of space, shape (n, 2, 3), as x, y, x, y in pixels, shape (n, 4); NaN for those that are not visible.

    Args:
        margin: how far beyond the picture's edge they go, pixels.

    Returns:
        Them, and the depths of both ends, shape (n, 2).
    """
    ends = np.asarray(segments, float).reshape(-1, 2, 3)
    width, height = size
    x, y, w = _homogeneous(view, ends, size)
    near = NEAR * _plane_distance(view) if view.eye is not None else 0.0
    depth = (ends - view.origin) @ view.axis
    # Each is at least 0 in what is seen; a homogeneous point (x, y, w) is at (x / w, y / w).
    sides = [
        depth - near if view.eye is None else w - near,
        x + margin * w,
        (width + margin) * w - x,
        y + margin * w,
        (height + margin) * w - y,
    ]
    first, last = np.zeros(len(ends)), np.ones(len(ends))
    for side in sides:
        start, end = side[:, 0], side[:, 1]
        meets = start / (start - end)
        first = np.where((start < 0) & (end >= 0), np.fmax(first, meets), first)
        last = np.where((start >= 0) & (end < 0), np.fmin(last, meets), last)
        last = np.where((start < 0) & (end < 0), -1.0, last)
    visible: npt.NDArray[np.bool_] = np.logical_and(first <= last, np.isfinite(ends).all(axis=(1, 2)))
    parts = np.where(visible[:, None], np.stack([first, last], 1), np.nan)
    found = [_between(values, parts) for values in (x, y, w, depth)]
    pixels = np.stack([found[0] / found[2], found[1] / found[2]], axis=2).reshape(-1, 4)
    return pixels, found[3]


def split(segments: npt.ArrayLike, pieces: int) -> Floats:
    """Each segment in equal pieces, shape (n * pieces, 2, 3): of a long one only a part may be hidden."""
    ends = np.asarray(segments, float).reshape(-1, 2, 3)
    cuts = np.linspace(0, 1, pieces + 1)[:, None]
    points = ends[:, None, 0] * (1 - cuts) + ends[:, None, 1] * cuts
    return cast(Floats, np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 2, 3))


def hidden(
    view: View, pixels: Floats, depths: Floats, picture: npt.ArrayLike, size: Size, slack: float = 1e-3
) -> npt.NDArray[np.bool_]:
    """Which segments a surface hides in their middle, shape (n,); invisible ones are not hidden.

    Args:
        pixels, depths: what `clipped_with_depth` gives.
        picture: depths of a picture's pixels (channel Z, infinite where nothing is), shape (rows, columns). It may be a
            coarse one of the same view.
        slack: part of the depth by which a segment may be behind the surface that it lies in.
    """
    surface = np.asarray(picture)
    rows, columns = surface.shape
    middle = (pixels[:, :2] + pixels[:, 2:]) / 2
    seen: npt.NDArray[np.bool_] = np.asarray(np.isfinite(middle).all(axis=1))
    place = np.where(seen[:, None], middle, 0.0) * (columns / size[0], rows / size[1])
    column = np.clip(place[:, 0].astype(int), 0, columns - 1)
    row = np.clip(place[:, 1].astype(int), 0, rows - 1)
    with np.errstate(invalid="ignore"):
        behind = _middle_depth(view, depths) * (1 - slack) > surface[row, column]
    return cast(npt.NDArray[np.bool_], seen & behind)


def _plane_distance(view: View) -> float:
    return float((view.center - view.eye) @ view.axis) if view.eye is not None else 1.0


def _homogeneous(view: View, points: Floats, size: Size) -> tuple[Floats, Floats, Floats]:
    """x, y and w of points: a picture shows them at (x / w, y / w), pixels; w is positive in front of an eye, else 1."""
    width, height = size
    if view.eye is None:
        offset, w = points - view.center, np.ones(points.shape[:-1])
        shift = np.zeros(3)
    else:
        offset = points - view.eye
        w = (offset @ view.axis) / _plane_distance(view)
        shift = view.eye - view.center
    across = offset @ view.side + (shift @ view.side) * w
    rise = offset @ view.up + (shift @ view.up) * w
    return width / 2 * w + across * (width / view.width), height / 2 * w - rise * (height / view.height), w


def _between(values: Floats, parts: Floats) -> Floats:
    """Values at both parts of the way from the first column to the second, shape (n, 2); exact at the ends."""
    return values[:, :1] * (1 - parts) + values[:, 1:] * parts


def _middle_depth(view: View, depths: Floats) -> Floats:
    """The depth in the middle of a segment's picture: an eye sees the harmonic mean there."""
    start, end = depths[:, 0], depths[:, 1]
    return (start + end) / 2 if view.eye is None else 2 * start * end / (start + end)
