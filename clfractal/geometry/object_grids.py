"""The grids of objects that are volumes, in one buffer, as kernels read them."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from clfractal.scene.given import GivenGrid
from clfractal.scene.model import Scene
from clfractal.scene.named_files import volumes_of
from clfractal.scene.object_grids import placed, used_level
from clfractal.scene.objects import VolumeObject
from clfractal.shading.transfer import TRANSFER_SIZE, Floats, medium_table, table_bounds, value_limits

CLOUD_COLUMNS = 7
"""Numbers of a cloud's transfer table for one value: see `medium_table`. Those of one that shines nowhere end in zeros."""
BRICK = 8
"""Cells along a side of a brick, whose least and largest value are known."""
NO_GRID: dict[str, object] = {
    "grid_sides": (0, 0, 0),
    **dict.fromkeys(("grid", "bricks", "transfer", "bounds"), 0),
    "voxel": 1.0,
    **dict.fromkeys(("level", "value_low", "value_range", "anisotropy"), 0.0),
}
"""The fields of an object that is no volume."""


class ObjectGrids:
    """Where each grid and each cloud's tables lie, and all of them.

    First come the files: of each the values, then the bricks' least and largest ones. Then the clouds: of each its transfer
    table, then the bounds of its extinction in the bricks.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.volumes = volumes_of(scene.objects)

    @cached_property
    def _files(self) -> dict[str, int]:
        """Where the values of each file begin."""
        found, place = {}, 0
        for file in dict.fromkeys(each.file for each in self.volumes.values()):
            found[file] = place
            grid = self.scene.grids[file]
            place += grid.values.size + 2 * brick_count(grid)
        return found

    @cached_property
    def _clouds(self) -> dict[str, int]:
        """Where the tables of each cloud begin."""
        grids = [self.scene.grids[file] for file in self._files]
        found, place = {}, sum(grid.values.size + 2 * brick_count(grid) for grid in grids)
        for name, each in self.volumes.items():
            if each.is_cloud:
                found[name] = place
                place += TRANSFER_SIZE * CLOUD_COLUMNS + brick_count(self.scene.grids[each.file])
        return found

    def fields(self, name: str, begin: int) -> dict[str, object]:
        """The fields of a volume, if all this begins at a number of the buffer."""
        each = self.volumes[name]
        grid = self.scene.grids[each.file]
        place = placed(each, grid)
        found = {
            **NO_GRID,
            "grid_sides": place.place.shape,
            "grid": begin + self._files[each.file],
            "bricks": begin + self._files[each.file] + grid.values.size,
            "voxel": place.voxel,
            "level": used_level(each, grid),
        }
        if each.is_cloud:
            low, high = value_limits(each.transfer, ())
            transfer = begin + self._clouds[name]
            found |= {
                "transfer": transfer,
                "bounds": transfer + TRANSFER_SIZE * CLOUD_COLUMNS,
                "value_low": low,
                "value_range": 1 / (high - low),
                "anisotropy": each.anisotropy,
            }
        return found

    @property
    def key(self) -> str:
        """A text that differs for different data."""
        clouds = [self.volumes[name].transfer.model_dump_json() for name in self._clouds]
        return " ".join(
            ["objects", *(self.scene.grids[file].digest for file in self._files), *clouds, str(self._color)]
        )

    @property
    def _color(self) -> tuple[float, float, float]:
        return self.scene.material.color

    def data(self) -> Floats:
        """All of it; one-dimensional."""
        parts: list[Floats] = []
        ranges: dict[str, Floats] = {}
        for file in self._files:
            values = _finite(self.scene.grids[file])
            ranges[file] = brick_ranges(values)
            parts += [values.reshape(-1), ranges[file].reshape(-1)]
        for name in self._clouds:
            each = self.volumes[name]
            low, high = value_limits(each.transfer, ())
            table = medium_table(each.transfer, (low, high), self._color)
            table = np.pad(table, ((0, 0), (0, CLOUD_COLUMNS - table.shape[1])))
            most = table[:, 0].astype(np.float64)
            parts += [table.reshape(-1), table_bounds(most, ranges[each.file], low, 1 / (high - low))]
        return np.concatenate(parts)


def clouds_of(scene: Scene) -> list[VolumeObject]:
    """The volumes that light goes through."""
    return [each for each in volumes_of(scene.objects).values() if each.is_cloud]


def grid_defines() -> dict[str, object]:
    """The defines of programs that send rays past volumes."""
    return {"TRANSFER_SIZE": TRANSFER_SIZE, "CLOUD_COLUMNS": CLOUD_COLUMNS}


def brick_count(grid: GivenGrid) -> int:
    """Bricks of a grid: there are cells beyond the outermost middles, too."""
    nz, ny, nx = (-(-(count + 1) // BRICK) for count in grid.values.shape)
    return int(nz * ny * nx)


def brick_ranges(values: Floats) -> Floats:
    """The least and the largest of the values that each brick's cells lie between; shape (bricks, 2), x fastest.

    Args:
        values: shape (nz, ny, nx), all finite.
    """
    low = high = np.pad(values, 1, mode="edge")
    for axis in range(3):
        count = low.shape[axis]
        first = np.arange(0, count - 1, BRICK)
        # The last of a brick's nine values is the first of the next brick's.
        last = np.minimum(first + BRICK, count - 1)
        low = np.minimum(np.minimum.reduceat(low, first, axis), low.take(last, axis))
        high = np.maximum(np.maximum.reduceat(high, first, axis), high.take(last, axis))
    return np.stack([low.reshape(-1), high.reshape(-1)], axis=1)


def _finite(grid: GivenGrid) -> Floats:
    """The values; NaN is the least one."""
    values: npt.NDArray[np.float32] = np.ascontiguousarray(grid.values, np.float32)
    if np.isfinite(values).all():
        return values
    return np.nan_to_num(values, nan=grid.low, posinf=grid.high, neginf=grid.low)
