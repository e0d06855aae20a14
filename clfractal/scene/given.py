"""Grids from files that volume scenes and objects show: read, given a place, and kept with the scene."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clfractal.errors import Where
from clfractal.scene.beside import reading_beside
from clfractal.scene.grid_place import GridPlace, vector_of
from clfractal.scene.grid_values import finite_range

if TYPE_CHECKING:
    from clfractal.files.volume_file import Volume
    from clfractal.scene.volume import Box


@dataclass(frozen=True, eq=False)
class GivenGrid:
    """Values on a grid, and where it is.

    Attributes:
        values: shape (nz, ny, nx). Each axis of the array is the one of the file that follows x, y or z most closely, and
            goes the same way: of a grid along the axes x, y and z grow with the index.
        place: of the grid.
        low, high: the least and largest finite value; of a single one half before and after it.
    """

    values: npt.NDArray[Any]
    place: GridPlace
    low: float
    high: float

    @cached_property
    def digest(self) -> str:
        """A text that differs for different values, and for the same ones in another place."""
        found = hashlib.sha256(np.ascontiguousarray(self.values).data)
        found.update(repr(self.place).encode())
        return found.hexdigest()


def read_grid(file: str, folder: Path, where: Where, box: Box | None = None) -> GivenGrid:
    """The grid of a file beside a scene that was loaded from `folder`, in a box or in its own place.

    Raises:
        FileError: at `where`, for a file out of the folder, or whatever is wrong with it.
    """
    from clfractal.files.volume_file import read_volume

    with reading_beside(file, folder, where) as path:
        return _placed(read_volume(path), box)


def _placed(volume: Volume, box: Box | None) -> GivenGrid:
    values, directions = volume.values, volume.directions
    # Which axis of space each axis of the array follows most closely, and whether it runs against it.
    order = _order(directions)
    values = values.transpose([2 - order[2], 2 - order[1], 2 - order[0]])
    steps = directions[list(order)]
    flipped = np.diag(steps) < 0
    values = values[tuple(slice(None, None, -1 if flipped[axis] else 1) for axis in (2, 1, 0))]
    nx, ny, nz = shape = values.shape[::-1]
    # An axis that is flipped begins where it ended.
    first = volume.origin + (np.where(flipped, np.array(shape) - 1, 0)[:, None] * steps).sum(axis=0)
    steps = np.where(flipped[:, None], -steps, steps) + 0.0  # (no -0, which files would show)
    x, y, z = (vector_of(step) for step in steps)
    place = GridPlace(vector_of(first - steps.sum(axis=0) / 2), (x, y, z), (nx, ny, nz))
    if box is not None:
        # As large as fits into the box, in its middle.
        place = place.moved(box.center, float((np.array(box.sides) / place.box).min()))
    low, high = finite_range(values) or (0.0, 1.0)
    if low == high:
        low, high = low - 0.5, high + 0.5
    return GivenGrid(values, place, low, high)


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
