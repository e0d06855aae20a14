"""Solids and their joins as distances in NumPy, arrays of points of shape (..., 3)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.schema.shape import turned_axes
from tests.render.shots import (
    BALL_RADIUS,
    SPHERE_CENTER,
    SPHERE_RADIUS,
    normals_of,
    points_of,
    rays,
    shoot,
)

Floats = npt.NDArray[np.float64]
Distance = Callable[[Floats], Floats]

TURN, MOVED, SCALE = [20, -35, 50], [0.2, 0.1, -0.1], 0.7


def ball(points: Floats) -> Floats:
    return np.asarray(np.linalg.norm(points, axis=-1) - BALL_RADIUS)


def solids(points: Floats) -> Floats:
    """`SOLIDS`, which is 0 inside where it is a formula's."""
    q = np.abs(points - [0, 0, -0.25]) - [1.2, 1.2, 0.25]
    box = np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0)
    return np.asarray(np.minimum(np.linalg.norm(points - SPHERE_CENTER, axis=-1) - SPHERE_RADIUS, box))


def placed(distance: Distance, scale: float = SCALE, place: list[float] | None = None) -> Distance:
    axes, middle = np.array(turned_axes((20.0, -35.0, 50.0))), np.array(place or MOVED)
    return lambda points: scale * distance((points - middle) @ axes.T / scale)


def a_sphere(center: list[float], radius: float) -> Distance:
    return lambda points: np.linalg.norm(points - center, axis=-1) - radius


def a_box(points: Floats) -> Floats:
    """Of sides 1.2, 0.5, 0.9 in its own space."""
    q = np.abs(points) - [0.6, 0.25, 0.45]
    return np.asarray(np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0))


def a_cylinder(points: Floats) -> Floats:
    """Of radius 0.4 and height 1.3 in its own space."""
    q = np.stack([np.linalg.norm(points[..., :2], axis=-1) - 0.4, np.abs(points[..., 2]) - 0.65], -1)
    return np.asarray(np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0))


def a_plane(points: Floats) -> Floats:
    return np.asarray(
        (points - [0, 0, 0.2]) @ (np.array([0.3, -0.2, 2.0]) / np.linalg.norm([0.3, -0.2, 2.0]))
    )


def smooth(a: Floats, b: Floats, width: float) -> Floats:
    share = np.maximum(width - np.abs(a - b), 0) / width
    return np.asarray(np.minimum(a, b) - 0.25 * width * share**2)


def marched(distance: Distance, origin: Floats, direction: Floats, far: float = 8.0) -> Floats:
    """Where rays first meet the solid, by small safe steps; infinite where they do not."""
    t = np.zeros(direction.shape[:-1])
    for _ in range(400):
        t = np.minimum(t + 0.7 * np.maximum(distance(origin + t[..., None] * direction), 0), far)
    t[distance(origin + t[..., None] * direction) > 1e-7] = np.inf
    return t


def normal_at(distance: Distance, points: Floats) -> Floats:
    step = 1e-5 * np.eye(3)
    slope = np.stack([distance(points + e) - distance(points - e) for e in step], -1)
    return np.asarray(slope / np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-30))


PLACED = {"rotation": TURN, "position": MOVED}
APART = [0.5, -0.7, 0.3]
SIMPLE: dict[str, tuple[dict[str, Any], Distance]] = {
    "sphere": ({"type": "sphere", "position": APART, "radius": 0.5}, a_sphere(APART, 0.5)),
    "box": (
        {"type": "box", "size": [1.2, 0.5, 0.9], "rotation": TURN, "position": APART},
        placed(a_box, 1, APART),
    ),
    "cylinder": (
        {"type": "cylinder", "radius": 0.4, "height": 1.3, "rotation": TURN, "position": APART},
        placed(a_cylinder, 1, APART),
    ),
    "plane": ({"type": "plane", "position": [0, 0, 0.2], "normal": [0.3, -0.2, 2]}, a_plane),
}


def beside_a_rim(met: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Pixels with one of the other kind at most two pixels away."""
    edged = np.pad(met, 2, mode="edge")
    rows, columns = met.shape
    around = [edged[i : i + rows, j : j + columns] for i in range(5) for j in range(5)]
    return np.asarray(np.any(around, axis=0) != np.all(around, axis=0))


def agree(
    device: Device,
    scene: Any,
    distance: Distance,
    *,
    precision: Precision = "float32",
    lanes: int | None = None,
    degrees: float = 1.0,
) -> npt.NDArray[np.bool_]:
    """A picture and the distance have the same places and, at most places, normals that are `degrees` apart at most."""
    framebuffer = shoot(scene, device, precision, **({"lanes": lanes} if lanes else {}))
    origin, direction, footprint = rays(scene)
    t = marched(distance, origin, direction)
    met, hit = np.isfinite(t), framebuffer["A"] == 1
    assert ((met == hit) | beside_a_rim(met)).all()
    assert (met != hit).mean() < 0.04
    points = origin + np.where(met, t, 0)[..., None] * direction
    normals = normal_at(distance, points)
    # At rims a pixel's cone meets what its ray does not.
    front = met & hit & ((normals * direction).sum(-1) < -0.4)
    assert front.mean() > 0.1
    width = footprint * (t if scene.camera.projection == "perspective" else 1)
    off = (np.linalg.norm(points_of(framebuffer) - points, axis=-1) / width)[front]
    assert np.median(off) < 0.25
    assert (off > 0.8).mean() < 0.04, np.percentile(off, [50, 80, 90, 95, 99])
    angle = np.degrees(np.arccos(np.clip((normals_of(framebuffer) * normals).sum(-1), -1, 1)))[front]
    assert np.percentile(angle, 80) < degrees
    return np.asarray(front)
