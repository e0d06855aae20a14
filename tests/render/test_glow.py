"""Glow around the set, against quadrature where the distance is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests.render.shots import ORTHOGRAPHIC, PERSPECTIVE, Floats, rays, shoot, stacked, to_sphere
from tests.scenes import scene_of
from tests.variants import one_of

SIDE, RADIUS = 32, 0.8
COLOR = np.array([1.0, 0.5, 0.25])
BLACK = {"color": [0, 0, 0], "ambient": 0, "diffuse": 0, "specular": 0}
# A map that does nothing, and a solid whose distance is known.
SPHERE: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "map": ["x", "y", "z"],
    "add": "none",
    "degree": 1,
    "shape": f"sqrt(x*x + y*y + z*z) - {RADIUS}",
    "bounds": {"center": [0, 0, 0], "radius": 1},
    "bailout": 30,
}


def glowing(samples: int, camera: dict[str, Any] = PERSPECTIVE, **sections: Any) -> Scene:
    """A black ball before black, so that only the glow is seen."""
    glow = {"color": COLOR.tolist(), "intensity": 0.7, "width": 0.15, **sections.pop("glow", {})}
    return scene_of(
        SPHERE,
        camera,
        (SIDE, SIDE),
        lights=[],
        background={"top": [0, 0, 0], "bottom": [0, 0, 0]},
        glow=glow,
        renderer={"samples": samples},
        **{"material": BLACK, **sections},
    )


def places(scene: Scene, parts: int = 4000) -> tuple[Floats, Floats, Any]:
    """Of each pixel's middle ray the middles of many parts, a part's length, and where it is free."""
    origin, way, _ = rays(scene)
    origin = np.broadcast_to(origin, way.shape)
    t = (np.arange(parts) + 0.5) * (8 / parts)
    points = origin[..., None, :] + t[:, None] * way[..., None, :]
    distance, nearest = to_sphere(origin, way, [0, 0, 0], RADIUS)
    far = np.where(nearest < RADIUS, distance, 8.0)
    return points, np.full(t.shape, 8 / parts), t < far[..., None]


def expected(scene: Scene) -> Floats:
    glow: Any = scene.glow
    points, step, free = places(scene)
    distance = np.maximum(np.linalg.norm(points, axis=-1) - RADIUS, 0)
    bright = np.exp(-distance / glow.width) * free
    if glow.by == "trap":
        # The orbit stays where it began.
        bright *= np.exp(-np.abs(points[..., 2] - glow.trap.center[2]) / glow.reach)
    if scene.fog is not None:
        bright *= np.exp(-scene.fog.density * np.cumsum(step))
    total = (bright * step).sum(axis=-1) / glow.width
    return np.asarray(total[..., None] * glow.intensity * COLOR)


def sure(scene: Scene) -> Any:
    """Pixels without the ball's rim."""
    origin, way, _ = rays(scene)
    _, nearest = to_sphere(np.broadcast_to(origin, way.shape), way, [0, 0, 0], RADIUS)
    return (nearest < 0.9 * RADIUS) | (nearest > 1.1 * RADIUS)


PLANE_TRAP = {"by": "trap", "reach": 0.3, "trap": {"shape": "plane", "center": [0, 0, 0.5]}}
CASES: dict[str, dict[str, Any]] = {
    "close": {},
    "wide": {"glow": {"width": 0.6}},
    "narrow": {
        "glow": {"width": 0.02},
        "camera": {**ORTHOGRAPHIC, "height": 0.5, "target": [1, 0.1, 0], "position": [2, -2, 1.5]},
    },
    "trap": {"glow": PLANE_TRAP},
    "fog": {"fog": {"density": 0.4, "color": [0, 0, 0], "background": False}},
    "paths": {"lighting": {"mode": "path", "bounces": 1}},
    "parallel": {"camera": ORTHOGRAPHIC},
}


@pytest.mark.parametrize("case", one_of("paths", *(case for case in CASES if case != "paths")))
def test_glow_is_the_integral(device: Device, case: str) -> None:
    scene = glowing(256, **CASES[case])
    seen = stacked(shoot(scene, device), ("R", "G", "B")).astype(float)
    wanted, inner = expected(scene), sure(scene)
    assert wanted[inner].max() > 0.1
    assert abs(seen[inner].mean() / wanted[inner].mean() - 1) < 0.01
    np.testing.assert_allclose(seen[inner], wanted[inner], rtol=0.06, atol=0.02 * wanted[inner].max())


def test_a_mirror_shows_glow(device: Device) -> None:
    """Rays that leave a ball gather as much as those that arrive. (Close up, where they begin near the surface.)"""
    close = {"position": [1.5, -2.5, 1.2], "target": [0, 0, 0], "fov": 0.5}
    wide = {"width": 0.6}
    plain = shoot(glowing(64, close, glow=wide), device)["R"].astype(float)
    mirror = shoot(glowing(64, close, glow=wide, material={**BLACK, "reflection": 0.5}), device)["R"].astype(
        float
    )
    assert mirror.mean() / plain.mean() == pytest.approx(1.5, rel=0.01)
