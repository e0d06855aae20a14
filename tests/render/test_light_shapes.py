"""Spots, balls and rectangles as lights over flat ground, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from tests.render.known_lights import BRIGHT, CASES, SPOT, ground
from tests.render.shots import ORTHOGRAPHIC, SOLIDS, colors, points_of, shoot
from tests.scenes import scene_of


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
    framebuffer = shoot(scene, device)
    on_ground = ground(framebuffer)
    found, right = colors(framebuffer)[on_ground][:, 0], expected(points_of(framebuffer)[on_ground])
    assert on_ground.sum() > 500
    assert right.mean() > 0.05
    ratio = found.mean() / right.mean()
    assert ratio == pytest.approx(1, abs=0.02)
    if mode == "direct":
        assert np.median(np.abs(found - right)) < 0.03 * right.mean() + 0.002
