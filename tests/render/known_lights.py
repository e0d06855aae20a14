"""Lamps with a shape over the ground, and how bright they make it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clfractal.images.framebuffer import Framebuffer
from tests.render.shots import Floats, points_of

PLACE = np.array([0.3, 0.2, 2.5])

BALL = {"type": "sphere", "position": PLACE.tolist(), "radius": 0.7, "intensity": 3}

WINDOW = {
    "type": "rectangle",
    "position": PLACE.tolist(),
    "direction": [0.3, 0, -1],
    "width": 1.5,
    "height": 0.8,
    "intensity": 3,
}

SPOT = {"type": "spot", "position": PLACE.tolist(), "angle": 50, "softness": 0.5, "intensity": 5}


def of_ball(points: Floats) -> Floats:
    """L (r/d)^2 cos: irradiance over pi where the ball is wholly above the horizon."""
    way = PLACE - points
    square = (way**2).sum(-1)
    return np.asarray(3 * 0.7**2 / square * way[..., 2] / np.sqrt(square))


def of_window(points: Floats) -> Floats:
    """Lambert's formula for polygons: half the sum over edges of their angle times their plane's normal, over pi."""
    axis = np.array([0.3, 0, -1]) / np.hypot(0.3, 1)
    side = np.cross(axis, [0, 1, 0])
    side = side / np.linalg.norm(side) * 0.75
    upward = np.array([0, 0.4, 0])
    corners = [PLACE + a * side + b * upward for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    ways = [(corner - points) / np.linalg.norm(corner - points, axis=-1, keepdims=True) for corner in corners]
    total = np.zeros(points.shape[:-1])
    for one, other in zip(ways, [*ways[1:], ways[0]], strict=True):
        normal = np.cross(one, other)
        size = np.linalg.norm(normal, axis=-1)
        total += np.arctan2(size, (one * other).sum(-1)) * normal[..., 2] / size
    return np.abs(total) * 3 / (2 * np.pi)


def of_spot(points: Floats) -> Floats:
    way = PLACE - points
    distance = np.linalg.norm(way, axis=-1)
    cosine = way[..., 2] / distance
    t = np.clip((25 - np.degrees(np.arccos(cosine))) / 12.5, 0, 1)
    return np.asarray(5 * cosine / distance**2 * t * t * (3 - 2 * t))


CASES = [(BALL, of_ball), (WINDOW, of_window), (SPOT, of_spot)]

BRIGHT = {"color": [1, 1, 1], "ambient": 0, "diffuse": 0, "specular": 0}


def ground(framebuffer: Framebuffer) -> npt.NDArray[np.bool_]:
    """Where the top of the box is seen, away from its edges."""
    points = points_of(framebuffer)
    inner = (np.abs(points[..., :2]) < 1.15).all(axis=-1)
    return np.asarray((framebuffer["A"] == 1) & (np.abs(points[..., 2]) < 0.011) & inner)
