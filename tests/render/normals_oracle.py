"""The five normals in NumPy, from the depths of a pixel's points (Englund 2010, sec. 3.2.3).

Everything is in the pixel's frame: x right, y up, z to the viewer, the origin where the eye is (perspective) or on the
plane that depth 0 lies in (orthographic). Arrays may have any leading axes; the last ones are said with each function.
A depth of NaN, or a point with one, is a point that found no surface. A normal that cannot be made is NaN.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating[Any]]

UPPER, CENTER, LOWER_LEFT, LOWER_RIGHT = 1, 4, 6, 8
# Counterclockwise from the upper left, as the viewer sees them.
AROUND = (0, 3, 6, 7, 8, 5, 2, 1)
# Patterns of points with a smaller product of the squared widths, over the square of their sum, are taken for a line.
THINNEST = 2.5e-5


def grid_offsets(side: int) -> Floats:
    """Places of a grid's points: pixels right and up from the pixel's centre, row by row from the top left, (side^2, 2)."""
    steps = (np.arange(side) + 0.5) / side - 0.5
    return np.array([(right, -below) for below in steps for right in steps])


def unit(vectors: Floats) -> npt.NDArray[np.float64]:
    """Vectors (..., 3) at length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True), np.float64)


def least_squares(points: Floats) -> tuple[Floats, Floats]:
    """Normals (..., 3) of the planes z = p0 + x p1 + y p2 by least squares, and the points' rms distances (...)."""
    count = points.shape[-2]
    each = points.reshape(-1, count, 3)
    normals, residuals = np.full((len(each), 3), np.nan), np.full(len(each), np.nan)
    for pixel, given in enumerate(each):
        there = given[np.isfinite(given).all(axis=1)]
        if thinness(there) <= THINNEST:
            continue
        centered = there - there.mean(axis=0)
        slopes, *_ = np.linalg.lstsq(centered[:, :2], centered[:, 2], rcond=None)
        normals[pixel] = unit(np.array([-slopes[0], -slopes[1], 1.0]))
        residuals[pixel] = np.sqrt(np.mean((centered @ normals[pixel]) ** 2))
    return normals.reshape(*points.shape[:-2], 3), residuals.reshape(points.shape[:-2])


def thinness(points: Floats) -> float:
    """How far points (count, 2 or 3) are from a line as the viewer sees them: 0 on one, 1/4 if no direction is longer."""
    if len(points) < 3:
        return 0.0
    widths = np.linalg.svd(points[:, :2] - points[:, :2].mean(axis=0), compute_uv=False) ** 2
    total = widths.sum()
    return float(widths[0] / total * widths[1] / total) if total > 0 else 0.0


def one_triangle(points: Floats) -> Floats:
    """(LR - LL) x (U - LL) of 3 x 3 points (..., 9, 3); least squares where one of the three is missing."""
    corner = points[..., LOWER_LEFT, :]
    normals = unit(np.cross(points[..., LOWER_RIGHT, :] - corner, points[..., UPPER, :] - corner))
    return _or_plane(normals, points)


def eight_triangles(points: Floats) -> Floats:
    """Normals (..., 8, 3) of the triangles around the centre of 3 x 3 points; NaN where a corner is missing."""
    arms = points[..., AROUND, :] - points[..., CENTER : CENTER + 1, :]
    return unit(np.cross(arms, np.roll(arms, -1, axis=-2)))


def eight_triangles_normal(points: Floats) -> Floats:
    """The mean (..., 3) of those of the eight normals that exist; least squares where none does."""
    eight = eight_triangles(points)
    return _or_plane(unit(np.where(np.isnan(eight), 0.0, eight).sum(axis=-2) + _none_as_nan(eight)), points)


def eight_triangles_shading(points: Floats, shade: Callable[[Floats], Floats]) -> Floats:
    """The mean of the shadings, shade((..., 3)) -> (..., channels), of the normals that exist; else of the plane's."""
    eight = eight_triangles(points)
    there = ~np.isnan(eight).any(axis=-1, keepdims=True)
    shaded = np.where(there, shade(np.where(there, eight, [0.0, 0.0, 1.0])), 0.0)
    count = there.sum(axis=-2)
    plane, _ = least_squares(points)
    return np.where(count > 0, shaded.sum(axis=-2) / np.maximum(count, 1), shade(plane))


def _none_as_nan(eight: Floats) -> Floats:
    """0, or NaN where none of the eight exists; shape (..., 1)."""
    return np.where(np.isnan(eight).all(axis=(-2, -1)), np.nan, 0.0)[..., None]


def _or_plane(normals: Floats, points: Floats) -> Floats:
    missing = np.isnan(normals).any(axis=-1)
    normals = normals.copy()
    normals[missing] = least_squares(points[missing])[0]
    return normals
