"""Fog around what shines, and what it scatters of that by sums along the rays."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests.render.media import phase
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import PERSPECTIVE, Floats, rays, shoot, stacked
from tests.scenes import scene_of

SIDE = 16
BLACK = {"color": [0, 0, 0], "ambient": 0, "diffuse": 0, "specular": 0}
EVEN = {"density": 0.4}
LAYER = {"density": 0.5, "height": 0.5}
MIST = {"density": 0.3, "anisotropy": 0.6}
COLOR = np.array([1, 0.5, 0.25])
Shines = Callable[[Floats, Floats], Floats]
"""At places, shape (n, 3), the integral of radiance by the phase function of light that goes on along a direction."""


def foggy(fog: dict[str, Any], **sections: Any) -> Scene:
    """Fog around nothing, or around what the sections have, which is black."""
    scattering = {"anisotropy": fog.get("anisotropy", 0.0)}
    own = {key: value for key, value in fog.items() if key != "anisotropy"}
    usual: dict[str, Any] = {
        "lights": [],
        "material": BLACK,
        "background": [0, 0, 0],
        "lighting": {"mode": "path", "bounces": 1},
        "fog": {"color": [0, 0, 0], "background": False, "scattering": scattering, **own},
        "renderer": {"samples": 256},
    }
    formula = sections.pop("formula", NOWHERE)
    return scene_of(formula, PERSPECTIVE, (SIDE, SIDE), **{**usual, **sections})


def summed(scene: Scene, shines: Shines, parts: int = 3000) -> Floats:
    """Of each pixel's middle ray, to infinity, shape (SIDE, SIDE, 3)."""
    fog: Any = scene.fog
    origin, way, _ = rays(scene)
    origin = np.broadcast_to(origin, way.shape)
    # Parts that grow with the distance: the near ones count most.
    edge = np.concatenate([np.linspace(0, 8, parts), np.geomspace(8, 300, 300)[1:]])
    t, step = (edge[1:] + edge[:-1]) / 2, np.diff(edge)
    found = np.zeros(way.shape)
    for place in np.ndindex(way.shape[:2]):
        points = origin[place] + t[:, None] * way[place]
        density = np.full(len(t), fog.density)
        if fog.height is not None:
            density = fog.density * np.exp(np.minimum(-(points[:, 2] - fog.base) / fog.height, 80))
        passes = np.exp(-(np.cumsum(density * step) - density * step / 2))
        found[place] = (density * passes * step) @ shines(points, way[place])
    return found


def of_ball(scene: Scene, place: Any, radius: float, radiance: Any) -> Shines:
    """A ball that is seen under its solid angle, far enough for the phase function of its middle."""
    fog: Any = scene.fog

    def shines(points: Floats, way: Floats) -> Floats:
        toward = np.asarray(place) - points
        square = (toward**2).sum(axis=1)
        angle = 2 * math.pi * (1 - np.sqrt(np.maximum(1 - radius**2 / square, 0)))
        part = phase(toward @ way / np.sqrt(square), fog.scattering.anisotropy)
        return np.asarray((angle * part)[:, None] * np.asarray(radiance))

    return shines


def agree(
    scene: Scene, device: Device, shines: Shines, here: Any = True, noise: float = 0.15, parts: int = 3000
) -> None:
    """The mean of pixels within 1.5 %, and each within the noise of its samples."""
    seen = stacked(shoot(scene, device), ("R", "G", "B")).astype(float)
    wanted = summed(scene, shines, parts)
    here = np.broadcast_to(here, wanted.shape[:2])
    assert here.sum() > SIDE * SIDE / 4
    assert wanted[here].max() > 0.01
    assert seen[here].mean(axis=0) == pytest.approx(wanted[here].mean(axis=0), rel=0.015)
    np.testing.assert_allclose(seen[here], wanted[here], rtol=noise, atol=0.03 * wanted[here].max())


def both(*shines: Shines) -> Shines:
    return lambda points, way: np.asarray(sum(each(points, way) for each in shines))
