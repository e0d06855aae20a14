"""Grids from files that volume scenes and objects show: they are read, turned along the axes, and kept with the scene."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clfractal.device.activity import doing
from clfractal.errors import FileError, Where
from clfractal.scene.base import Vector

if TYPE_CHECKING:
    from clfractal.scene.volume import Box, VolumeRenderer

_WHERE = Where(path="renderer.file")


@dataclass(frozen=True, eq=False)
class GivenGrid:
    """Values on a grid along the axes.

    Attributes:
        values: shape (nz, ny, nx), x, y and z growing with the index.
        corner: the least corner of the box, scene units.
        spacing: sides of a voxel, scene units.
        low, high: the least and largest finite value.
    """

    values: npt.NDArray[Any]
    corner: Vector
    spacing: Vector
    low: float
    high: float

    @cached_property
    def digest(self) -> str:
        """A text that differs for different values."""
        return hashlib.sha256(np.ascontiguousarray(self.values).data).hexdigest()


def read_given(renderer: VolumeRenderer, folder: Path) -> GivenGrid:
    """The grid of a scene that was loaded from `folder`, in the renderer's box if it has one, else in its own place.

    Raises:
        FileError: at renderer.file, for a file out of the folder, or whatever is wrong with it.
    """
    assert renderer.file is not None
    return read_grid(renderer.file, folder, _WHERE, renderer.box)


def read_grid(file: str, folder: Path, where: Where, box: Box | None = None) -> GivenGrid:
    """The grid of a file beside a scene that was loaded from `folder`, in a box or in its own place.

    A grid whose axes are tilted is shown as if they were the axes of space.

    Raises:
        FileError: at `where`, for a file out of the folder, or whatever is wrong with it.
    """
    from clfractal.formulas.catalog import safe_path

    path = safe_path(file, folder, where)
    with doing(f"reading {path}"):
        return _read(path, where, box)


def _read(path: Path, where: Where, box: Box | None) -> GivenGrid:
    from clfractal.files.volume import read_volume

    try:
        volume = read_volume(path)
    except FileError as error:
        raise FileError(error.inside(str(path)), where, details=error.details) from error
    values, directions = volume.values, volume.directions
    # Which axis of space each axis of the array follows most closely, and whether it runs against it.
    order = _order(directions)
    values = values.transpose([2 - order[2], 2 - order[1], 2 - order[0]])
    rows = directions[list(order)]
    spacing = np.linalg.norm(rows, axis=1)
    flipped = [bool(rows[axis, axis] < 0) for axis in range(3)]
    values = values[tuple(slice(None, None, -1 if flipped[axis] else 1) for axis in (2, 1, 0))]
    shape = np.array(values.shape[::-1])
    ends = np.stack(
        [
            volume.origin,
            volume.origin + (shape - 1) @ (spacing[:, None] * np.eye(3) * np.where(flipped, -1, 1)[:, None]),
        ]
    )
    corner = ends.min(axis=0) - spacing / 2
    if box is not None:
        size = spacing * shape
        # As large as fits into the box, in its middle.
        scale = float((np.array(box.sides) / size).min())
        spacing = spacing * scale
        corner = np.array(box.center) - spacing * shape / 2
    low, high = _range(values)
    return GivenGrid(values, _vector(corner), _vector(spacing), low, high)


def _order(directions: npt.NDArray[np.float64]) -> tuple[int, int, int]:
    """For each axis of space the axis of the array that runs along it."""
    left = np.abs(directions / np.linalg.norm(directions, axis=1, keepdims=True)).copy()
    order = [0, 0, 0]
    for _ in range(3):
        array_axis, axis = np.unravel_index(int(left.argmax()), left.shape)
        order[int(axis)] = int(array_axis)
        left[array_axis, :] = -1
        left[:, axis] = -1
    return order[0], order[1], order[2]


def _range(values: npt.NDArray[Any]) -> tuple[float, float]:
    low, high = np.inf, -np.inf
    for layer in values:
        finite = layer[np.isfinite(layer)] if layer.dtype.kind == "f" else layer
        if finite.size:
            low, high = min(low, float(finite.min())), max(high, float(finite.max()))
    return (low, high) if low < high else (0.0, 1.0) if low > high else (low - 0.5, low + 0.5)


def _vector(array: npt.NDArray[np.float64]) -> Vector:
    x, y, z = (float(value) for value in array)
    return x, y, z
