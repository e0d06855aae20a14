"""Light that a medium adds by itself, beside the integral of dL/ds = j - sigma L through a cube of one density."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.shading.transfer import MOST_OPACITY
from tests.render.media import CAMERA, CORNER, SIDES, VOXEL, keep_media, light_of
from tests.render.shots import Floats, rays
from tests.render.volumes import to_box, volume_scene

DARK: dict[str, Any] = {
    "material": {"color": [0, 0, 0], "specular": 0},
    "lights": [],
    "background": "transparent",
}
LIGHT = np.array([0.03, 0.2, 0.006])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return keep_media(tmp_path_factory.mktemp("cube"))


def shown(
    folder: Path, device: Device, opacity: float, step: float, **sections: Any
) -> tuple[Floats, Floats]:
    """The picture's light, and how long rays are in the cube, in voxels."""
    transfer = {
        "opacity": [{"at": 0.5, "opacity": opacity}],
        "emission": [{"at": 0.5, "emission": LIGHT.tolist()}],
    }
    settings: dict[str, Any] = {"step": step, "opacity_limit": 1, "transfer": transfer}
    look = {**DARK, **sections}
    scene = volume_scene(CAMERA, folder=folder, size=(24, 24), look=look, file="cube.nrrd", **settings)
    near, far = to_box(*rays(scene)[:2], CORNER, SIDES)
    return light_of(scene, device), np.maximum(far - near, 0) / VOXEL


@pytest.mark.parametrize("opacity", [0.0, 0.02, 0.3, 1.0])
@pytest.mark.parametrize("step", [2.0, 0.5, 0.1])
def test_a_cube_that_shines(device: Device, folder: Path, opacity: float, step: float) -> None:
    """j (1 - exp(-sigma L)) / sigma, whatever the step; L is a whole number of steps."""
    light, length = shown(folder, device, opacity, step)
    steps = length / step
    # Where rounding may decide of a whole step.
    sure = np.abs(steps - np.rint(steps)) > 1e-3
    assert (length[sure] > 5).sum() > 100
    way = np.ceil(steps) * step
    sigma = -np.log(1 - min(opacity, MOST_OPACITY))
    expected = LIGHT * (way if sigma == 0 else -np.expm1(-sigma * way) / sigma)[..., None]
    np.testing.assert_allclose(light[sure], expected[sure], rtol=3e-4, atol=1e-6)


def test_emission_is_light_on_top(device: Device, folder: Path) -> None:
    """With a lit medium the picture is the sum of both."""
    lit = {
        "material": {"color": [0.4, 0.5, 0.6], "ambient": 1, "diffuse": 0, "specular": 0},
        "lights": [{"direction": [0, 1, -0.5], "shadow": False}],
    }
    alone, _ = shown(folder, device, 0.1, 0.5)
    both, length = shown(folder, device, 0.1, 0.5, **lit)
    inside = length > 5
    way = np.ceil(length[inside] / 0.5) * 0.5
    opacity = 1 - 0.9**way
    expected = opacity[:, None] * np.array([0.4, 0.5, 0.6])
    np.testing.assert_allclose(both[inside] - alone[inside], expected, rtol=2e-2, atol=2e-3)
