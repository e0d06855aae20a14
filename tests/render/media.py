"""Media in files, of which all is known: as a volume, and as objects."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.scene.model import Scene
from tests.render.shots import Floats, shoot, stacked
from tests.render.volumes import in_voxels, keep, middles, steps_of, to_box, value_at

SIDE, VOXELS = 2.0, 20
VOXEL = SIDE / VOXELS
CORNER, SIDES = np.full(3, -SIDE / 2), np.full(3, SIDE)
CAMERA = {"position": [1.6, -4.2, 1.3], "fov": 40}
OPACITY = 0.12
SIGMA = -np.log(1 - OPACITY) / VOXEL  # per scene unit, of a value of 1
# Steps of a grid that is turned, oblique and left-handed.
OBLIQUE = VOXEL * np.array([[0.9, 0.4, 0.1], [0.5, -0.8, 0.2], [0.1, 0.3, 1.0]])
WHITE: dict[str, Any] = {"background": {"top": [1, 1, 1], "bottom": [1, 1, 1]}}


def waves() -> Floats:
    """From 0 to 1 and back within a brick."""
    x, y, z = np.moveaxis(middles((VOXELS,) * 3, CORNER, [VOXEL] * 3), -1, 0)
    return np.asarray(np.clip(np.sin(7 * x) * np.cos(5 * z + y), 0, 1).astype(np.float32))


def keep_media(path: Path) -> Path:
    """A cube in which all voxels are 1, one whose values grow and fall, along the axes and oblique, and a soft ball."""
    keep(path / "cube.nrrd", np.ones((VOXELS,) * 3, np.float32), CORNER, [VOXEL] * 3)
    keep(path / "waves.nrrd", waves(), CORNER, [VOXEL] * 3)
    keep(path / "oblique.nrrd", waves(), -OBLIQUE.sum(0) * VOXELS / 2, OBLIQUE)
    distance = np.linalg.norm(middles((VOXELS,) * 3, CORNER, [VOXEL] * 3), axis=-1)
    keep(path / "ball.nrrd", np.clip(2 - 2 * distance, 0, 1).astype(np.float32), CORNER, [VOXEL] * 3)
    return path


def optical_depth(
    values: npt.NDArray[Any],
    corner: npt.ArrayLike,
    spacing: npt.ArrayLike,
    origin: Floats,
    direction: Floats,
    *,
    opacity: float = OPACITY,
    voxel: float | None = None,
) -> Floats:
    """Of rays through a grid, by its values at many places; `voxel`: whose opacity it is, if not its shortest side's."""
    steps = steps_of(spacing)
    first, way = in_voxels(origin - np.asarray(corner, float), steps), in_voxels(direction, steps)
    near, far = to_box(first, way, np.zeros(3), np.array(values.shape[::-1], float))
    long, depth = np.maximum(far - near, 0), np.zeros(near.shape)
    for part in (np.arange(1000) + 0.5) / 1000:
        value = value_at(values, np.nan_to_num(first + (near + part * long)[..., None] * way))
        depth -= np.log(1 - opacity * value) * long / 1000
    return np.asarray(depth / (voxel or np.linalg.norm(steps, axis=1).min()))


def phase(cosine: Floats, g: float) -> Floats:
    """Henyey and Greenstein's."""
    return np.asarray((1 - g * g) / (4 * np.pi * (1 + g * g - 2 * g * cosine) ** 1.5))


def light_of(scene: Scene, device: Device, **settings: Any) -> Floats:
    return stacked(shoot(scene, device, **settings), "RGB").astype(float)


def assert_alike(light: npt.NDArray[Any], expected: Floats, samples: int, share: float = 0.01) -> None:
    """In all within a hundredth; each pixel within five standard errors of one whose samples are 0 or 1."""
    assert light.mean() == pytest.approx(expected.mean(), rel=share)
    assert np.abs(light - expected).max() < 5 * 0.5 / np.sqrt(samples)
