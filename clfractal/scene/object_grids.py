"""The grids of volumes among a scene's objects: found beside the scene, and where they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from clfractal.errors import SceneError, Where
from clfractal.scene.given import GivenGrid, read_grid
from clfractal.scene.grid_place import GridPlace, vector_of
from clfractal.scene.named_files import grid_files
from clfractal.scene.objects import MAX_VALUES, VolumeObject
from clfractal.schema.base import Vector
from clfractal.schema.shape import ObjectBase, turned_axes


def read_grids(objects: Mapping[str, ObjectBase], folder: Path) -> dict[str, GivenGrid]:
    """The grids of a scene that was loaded from `folder`, by their files, each in the place that the file says.

    Raises:
        FileError: at the key that names it, for a file out of the folder, or whatever is wrong with it.
        SceneError: at that key, for more values than all of them may have.
    """
    found, count = {}, 0
    for file, key in grid_files(objects).items():
        found[file] = read_grid(file, folder, Where(path=key))
        count += found[file].values.size
        if count > MAX_VALUES:
            raise SceneError(
                f"has too many values: the grids of all objects may have {MAX_VALUES:,}, and these are {count:,}",
                Where(path=key),
            )
    return found


@dataclass(frozen=True, slots=True)
class PlacedGrid:
    """A grid where an object has it.

    Attributes:
        grid: its values.
        place: where they are.
    """

    grid: GivenGrid
    place: GridPlace

    @property
    def voxel(self) -> float:
        """The least side of a voxel, scene units: the length over which a cloud has its opacity."""
        return min(self.place.spacing)

    def value(self, point: Vector) -> float | None:
        """The value at a point, interpolated; None out of the grid."""
        counts = np.array(self.place.shape)
        own = self.place.own(point)
        if (own < 0).any() or (own > counts).any():
            return None
        place = np.clip(own - 0.5, 0, counts - 1)
        first = np.minimum(place.astype(int), np.maximum(counts - 2, 0))
        found, values = 0.0, self.grid.values
        for corner in np.ndindex(2, 2, 2):
            share = np.prod(np.where(corner, place - first, 1 - (place - first)))
            x, y, z = np.minimum(first + corner, counts - 1)
            found += float(share) * float(values[z, y, x]) if share > 0 else 0.0
        return found


def placed(each: VolumeObject, grid: GivenGrid) -> PlacedGrid:
    """Where an object has its grid: as its file has it, its middle at `position`, and scaled and turned about that."""
    steps = np.array(grid.place.steps)
    if each.size is not None:
        steps = steps * (each.size / np.linalg.norm(grid.place.edges, axis=1).max())
    # The factors are along the axes of the file's own space, which then are turned.
    x, y, z = (vector_of(step) for step in steps * each.scale @ np.array(turned_axes(each.rotation)))
    return PlacedGrid(grid, GridPlace((0.0, 0.0, 0.0), (x, y, z), grid.place.shape).moved(each.position))


def used_level(each: VolumeObject, grid: GivenGrid) -> float:
    """The value of its surface."""
    return (grid.low + grid.high) / 2 if each.level is None else each.level
