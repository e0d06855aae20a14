"""Scenes with a volume, and their grids as NumPy computes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.structs import Precision
from clfractal.formulas import reference
from clfractal.formulas.chain import Chain
from clfractal.integrators.lanes import best_lanes
from clfractal.scene.grid_place import GridPlace
from clfractal.scene.model import Scene
from clfractal.scene.volume import VolumeRenderer
from clfractal.voxels.fill import fill_grid
from clfractal.voxels.grid import Grid
from tests.devices import device
from tests.scenes import scene_of

Floats = npt.NDArray[np.float64]

CAMERA = {"position": [0, -4, 0], "target": [0, 0, 0], "fov": 45}


def volume_scene(formula: str | Mapping[str, Any], iterations: int, **renderer: Any) -> Scene:
    """A scene of a formula by name or inline, with a volume renderer."""
    return scene_of(formula, CAMERA, None, iterations=iterations, renderer={"type": "volume", **renderer})


def place_of(
    values: object, spacing: tuple[float, float, float], corner: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> GridPlace:
    """A place along the axes for an array; for what is none a place of one voxel."""
    shape = np.asarray(values).shape
    nz, ny, nx = shape if len(shape) == 3 else (1, 1, 1)
    return GridPlace.along_axes(corner, spacing, (nx, ny, nz))


def filled(
    scene: Scene, *, lanes: int | None = None, precision: Precision = "float32", **options: Any
) -> Grid:
    """The scene's grid."""
    assert isinstance(scene.renderer, VolumeRenderer)
    used = lanes if lanes is not None else best_lanes(device(), precision)
    return fill_grid(scene, scene.renderer, device(), lanes=used, precision=precision, **options)


def differing_voxels(first: Grid, second: Grid) -> int:
    """How many voxels of two grids have different values, as of a fill by octree and a brute one."""
    assert first.shape == second.shape
    return int(np.count_nonzero(first.dense() != second.dense()))


def voxel_points(place: GridPlace, offset: tuple[float, float, float] = (0.5, 0.5, 0.5)) -> Floats:
    """Points of voxels, shape (nz, ny, nx, 3), written down from the definition."""
    nx, ny, nz = place.shape
    z, y, x = np.meshgrid(np.arange(nz), np.arange(ny), np.arange(nx), indexing="ij")
    index = np.stack([x, y, z], axis=-1)
    points: Floats = np.array(place.corner) + (index + np.array(offset)) * np.array(place.spacing)
    return points


def inside(chain: Chain, points: Floats, iterations: int) -> npt.NDArray[np.bool_]:
    """Which points of shape (..., 3) belong to the solid."""
    flat = points.reshape(-1, 3)
    if chain.rule_index is not None and chain.degree <= 1:
        found = reference.own_distance(chain, flat, iterations) == 0
    elif chain.shape_index is not None:  # whatever becomes of z, here too
        found = reference.distance(chain, flat, iterations)[0] == 0
    else:
        found = reference.escape(chain, flat, iterations)[1]
    result: npt.NDArray[np.bool_] = found.reshape(points.shape[:-1])
    return result


def decoded(normals: npt.NDArray[np.uint8]) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Normals of bytes of shape (..., 4), of length 1, and where there is one."""
    vectors = normals[..., :3] / 127.5 - 1
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / length, (normals[..., :3] != 128).any(axis=-1)


# Voxels of a million that rounding in float32 may decide another way than float64: those at the surface whose orbits are
# long.
ROUNDED = 20e-6
