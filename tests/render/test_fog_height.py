"""Fog that is thinner above, against sums along the rays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests.render.shots import BALL_RADIUS, PERSPECTIVE, QUICK_BALL, Floats, rays, shoot, stacked, to_sphere
from tests.scenes import scene_of
from tests.variants import one_of

SIDE = 48
RED, MIST, SKY = np.array([0.8, 0.1, 0.1]), np.array([0.3, 0.4, 0.6]), np.array([0.1, 0.6, 0.1])


def scene_with(precision: str = "float32", **fog: Any) -> Scene:
    return scene_of(
        QUICK_BALL,
        PERSPECTIVE,
        (SIDE, SIDE),
        lights=[{"shadow": False}],
        material={"color": RED.tolist(), "ambient": 1, "diffuse": 0, "specular": 0},
        background={"top": SKY.tolist(), "bottom": SKY.tolist()},
        fog={"color": MIST.tolist(), **fog},
        renderer={"detail": 0.01, "precision": precision},
    )


def depth(origin: Floats, way: Floats, distance: Floats, fog: Any, parts: int = 4000) -> Floats:
    """The optical depth by the middles of many parts of the way."""
    up = np.array(fog.up) / np.linalg.norm(fog.up)
    start, rise = origin @ up, way @ up
    middles = (np.arange(parts) + 0.5) / parts
    level = start[..., None] + (rise * distance)[..., None] * middles
    density = fog.density * np.exp(np.minimum(-(level - fog.base) / fog.height, 80))
    return np.asarray(density.mean(axis=-1) * distance)


CASES: list[dict[str, Any]] = [
    {"density": 0.5, "height": 0.7},
    {"density": 0.2, "height": 5000.0},
    {"density": 2.0, "height": 0.1, "base": -0.6},
    {"density": 0.05, "height": 0.4, "base": 0.8, "up": [1, 2, -0.5]},
]


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("values", CASES)
def test_what_comes_through_is_the_integral(device: Device, values: dict[str, Any], precision: str) -> None:
    scene = scene_with(precision, **values)
    framebuffer = shoot(scene, device)
    seen = stacked(framebuffer, ("R", "G", "B")).astype(float)
    origin, way, _ = rays(scene)
    origin = np.broadcast_to(origin, way.shape)
    distance, nearest = to_sphere(origin, way, [0, 0, 0], BALL_RADIUS)
    inner = (framebuffer["A"] == 1) & (nearest < 0.98 * BALL_RADIUS)
    assert inner.sum() > 300
    through = np.exp(-depth(origin[inner], way[inner], distance[inner], scene.fog))[:, None]
    np.testing.assert_allclose(seen[inner], RED * through + MIST * (1 - through), atol=0.002)


@pytest.mark.parametrize("values", CASES)
def test_the_sky_comes_through_above(device: Device, values: dict[str, Any]) -> None:
    """As far as one sees up; down there is no end of it."""
    scene = scene_with(**values)
    framebuffer = shoot(scene, device)
    seen = stacked(framebuffer, ("R", "G", "B")).astype(float)
    origin, way, _ = rays(scene)
    origin = np.broadcast_to(origin, way.shape)
    fog: Any = scene.fog
    rise = way @ (np.array(fog.up) / np.linalg.norm(fog.up))
    up, down = (framebuffer["A"] == 0) & (rise > 0.02), (framebuffer["A"] == 0) & (rise <= 0)
    np.testing.assert_allclose(seen[down], np.broadcast_to(MIST, seen[down].shape), atol=1e-5)
    # Far enough that nothing of the fog is left.
    far = 40 * fog.height / rise[up]
    through = np.exp(-depth(origin[up], way[up], far, fog, parts=40_000))[:, None]
    np.testing.assert_allclose(seen[up], SKY * through + MIST * (1 - through), atol=0.003)


def test_without_a_height_nothing_has_changed(device: Device) -> None:
    """The greatest height is hardly one."""
    flat, high = shoot(scene_with(density=0.4), device), shoot(scene_with(density=0.4, height=1e6), device)
    np.testing.assert_allclose(flat["R"][flat["A"] == 1], high["R"][flat["A"] == 1], atol=1e-5)
