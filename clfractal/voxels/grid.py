"""A grid of voxels on a device: a table of bricks, and pools of samples and normals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.select import Device
from clfractal.scene.grid_place import GridPlace
from clfractal.voxels.lattice import BRICK, BRICK_SIDE, BRICK_STRIDE, Shape, bricks_of
from clfractal.voxels.pool import Parts

Kind = Literal["byte", "float"]
SAMPLE_BYTES: dict[Kind, int] = {"byte": 1, "float": 4}
_PIECE = 16 << 20  # bytes that are read at once
DTYPES: dict[Kind, type[np.generic]] = {"byte": np.uint8, "float": np.float32}

# Red, green and blue of a sample without a normal.
NO_NORMAL = 128


@dataclass(frozen=True, slots=True)
class GridStats:
    """What filling a grid took.

    Attributes:
        nodes: nodes of the octree whose distance was evaluated.
        evaluated_voxels: voxels (times their sub-points) whose value was evaluated.
        stored_bricks: bricks with samples of their own.
        solid_bricks: bricks that share the one that is inside as a whole.
        build_ms: compiling, or finding the programs in the cache.
        octree_ms, fill_ms, store_ms, normals_ms: time on the device of each stage; `normals_ms` is of normals
            beyond `gradient`, whose time is part of `store_ms`.
        wall_ms: of the whole fill, without building.
    """

    nodes: int = 0
    evaluated_voxels: int = 0
    stored_bricks: int = 0
    solid_bricks: int = 0
    build_ms: float = 0.0
    octree_ms: float = 0.0
    fill_ms: float = 0.0
    store_ms: float = 0.0
    normals_ms: float = 0.0
    wall_ms: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Voxels of a box, or of a block that is turned or oblique.

    A brick is 8 x 8 x 8 cells between middles of voxels. A stored one has 9 x 9 x 9 samples, voxels 8b to 8b + 8 along
    each axis (past the grid's end the last repeats), x fastest, then y, then z, in a slot of BRICK_STRIDE samples.

    Attributes:
        place: where the voxels are.
        kind: how samples are kept, `byte` or `float`.
        range: the least and the largest value that a voxel can have. Of `byte` the samples 0 and 255 stand for them;
            of `float` the samples are the values (of a given array of floats the range is 0 to 1, whatever it holds).
        device: where the buffers are.
        parts: slots of the pools and their parts.
        table_entries: of each brick its slot, or -(1 + sides) if it cannot be seen; int32 of shape (bz, by, bx). `sides`
            tells how far around it there is nothing, see `octree.empty_cubes`.
        table: the same on the device, x fastest.
        values: samples, uint8 or float32, in up to four buffers (`parts.ranges()`).
        normals: four bytes a sample: round(127.5 (n + 1)) of the outward normal's x, y and z (128 where there is
            none; its length is 0.9 to 1), and 255 inside, 0 outside. `least_squares` and `exact` ones are those of
            samples of a brick's cells that the surface goes through: of a sample that bricks share, a copy may still be
            by differences.
        solid_slot: the slot that all bricks share which are inside as a whole; None where each has its own.
        outside_slot: the slot that bricks share which are outside as a whole, where that can be seen; None where they are
            not stored, or each has its own.
        background: value of what is not stored.
        stats: what filling took.
    """

    place: GridPlace
    kind: Kind
    range: tuple[float, float]
    device: Device
    parts: Parts
    table_entries: npt.NDArray[np.int32]
    table: cl.Buffer
    values: tuple[cl.Buffer, ...]
    normals: tuple[cl.Buffer, ...]
    solid_slot: int | None
    outside_slot: int | None = None
    background: float = 0.0
    stats: GridStats = field(default_factory=GridStats)

    @property
    def shape(self) -> Shape:
        """Voxels along the grid's own axes."""
        return self.place.shape

    @property
    def bricks(self) -> Shape:
        """Bricks along these."""
        return bricks_of(self.place.shape)

    @property
    def corner(self) -> tuple[float, float, float]:
        """The outer corner of the first voxel, scene units."""
        return self.place.corner

    @property
    def spacing(self) -> tuple[float, float, float]:
        """Sides of a voxel, scene units."""
        return self.place.spacing

    def dense(self) -> npt.NDArray[Any]:
        """All values as stored, uint8 or float32 of shape (nz, ny, nx); `background` where nothing is stored."""
        nx, ny, nz = self.shape
        result = np.full((nz, ny, nx), self.background, DTYPES[self.kind])
        for place, samples in self._stored(self.values, DTYPES[self.kind], ()):
            target = result[place]
            target[...] = samples[tuple(slice(n) for n in target.shape)]
        return result

    def dense_normals(self) -> npt.NDArray[np.uint8]:
        """All normals as stored, shape (nz, ny, nx, 4); none, and outside, where nothing is stored."""
        nx, ny, nz = self.shape
        result = np.full((nz, ny, nx, 4), (NO_NORMAL, NO_NORMAL, NO_NORMAL, 0), np.uint8)
        for place, samples in self._stored(self.normals, np.uint8, (4,)):
            target = result[place]
            target[...] = samples[tuple(slice(n) for n in target.shape[:3])]
        return result

    def _stored(
        self, pool: tuple[cl.Buffer, ...], dtype: type[np.generic], more: tuple[int, ...]
    ) -> Iterator[tuple[tuple[slice, slice, slice], npt.NDArray[Any]]]:
        """Where each stored brick's samples are in a whole array, and the samples, shape (9, 9, 9, ...)."""
        flat = self.table_entries.reshape(-1)
        order = np.argsort(flat, kind="stable")
        slots = flat[order]
        by, bx = self.table_entries.shape[1:]
        each = np.dtype((dtype, (BRICK_STRIDE, *more))).itemsize
        some = max(_PIECE // each, 1)
        for buffer, (begin, end) in zip(pool, self.parts.ranges(), strict=True):
            for first in range(begin, end, some):  # a whole pool is as large as what is made of it
                after = min(first + some, end)
                samples = np.empty((after - first, BRICK_STRIDE, *more), dtype)
                with self.device.failures("reading the grid"):
                    cl.enqueue_copy(self.device.queue, samples, buffer, src_offset=(first - begin) * each)
                cubes = samples[:, : BRICK_SIDE**3].reshape(-1, BRICK_SIDE, BRICK_SIDE, BRICK_SIDE, *more)
                for index in order[np.searchsorted(slots, first) : np.searchsorted(slots, after)].tolist():
                    z, y, x = index // (by * bx), index // bx % by, index % bx
                    place = (_span(z), _span(y), _span(x))
                    yield place, cubes[flat[index] - first]


def _span(brick: int) -> slice:
    return slice(BRICK * brick, BRICK * brick + BRICK_SIDE)
