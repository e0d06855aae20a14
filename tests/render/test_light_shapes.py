"""Spots, balls and rectangles as lights over flat ground, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from tests.render.shots import ORTHOGRAPHIC, SOLIDS, Floats, points_of, scene_of, shoot
from tests.render.test_surface_rays import BRIGHT, colors, ground

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
    found: Floats = 3 * 0.7**2 / square * way[..., 2] / np.sqrt(square)
    return found


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
    found: Floats = 5 * cosine / distance**2 * t * t * (3 - 2 * t)
    return found


CASES = [(BALL, of_ball), (WINDOW, of_window), (SPOT, of_spot)]


@pytest.mark.parametrize(("light", "expected"), CASES, ids=["sphere", "rectangle", "spot"])
@pytest.mark.parametrize("mode", ["direct", "path"])
def test_ground_has_the_irradiance_of_closed_forms(
    device: Device, light: dict[str, Any], expected: Any, mode: str
) -> None:
    path = {"mode": "path", "bounces": 0}
    scene = scene_of(
        SOLIDS,
        {**ORTHOGRAPHIC, "position": [0.4, -2, 1.6]},
        lights=[{**light, "shadow": False, **({} if light is SPOT else {"visible": False})}],
        material={**BRIGHT, "diffuse": 1},
        lighting=path if mode == "path" else {"mode": "direct"},
        renderer={"samples": 16 if mode == "direct" else 64, "detail": 0.25},
        background=[0, 0, 0],
    )
    film = shoot(scene, device)
    on_ground = ground(film)
    found, right = colors(film)[on_ground][:, 0], expected(points_of(film)[on_ground])
    assert on_ground.sum() > 500
    assert right.mean() > 0.05
    ratio = found.mean() / right.mean()
    assert ratio == pytest.approx(1, abs=0.02)
    if mode == "direct":
        assert np.median(np.abs(found - right)) < 0.03 * right.mean() + 0.002
