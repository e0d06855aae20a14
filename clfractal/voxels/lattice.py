"""Where voxels are: the points of a grid, and the structs that tell kernels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.structs import Field, Precision, Struct
from clfractal.scene.grid_place import GridPlace
from clfractal.scene.volume import MAX_RESOLUTION, Box
from clfractal.schema.base import Vector

# Cells along the side of a brick, samples along it, and the room that a brick's samples take.
BRICK = 8
BRICK_SIDE = 9
BRICK_STRIDE = 736

Shape = tuple[int, int, int]
Places = npt.NDArray[np.uint64]

LATTICE = Struct(
    "Lattice",
    [
        Field("last", "int", 3, "the grid's last voxel along x, y and z"),
        Field("padded", "int", 3, "coordinates along x, y and z, the last repeated to whole bricks"),
        Field("sub_points", "int", 0, "points along the side of a voxel"),
        Field("margin", "real", 3, "how far a voxel's points are from its middle, scene units"),
        Field("middle_offset", "real", 3, "from a voxel's first sub-point to its middle, scene units"),
        Field("side", "real", 0, "the least side of a voxel, scene units"),
        Field("step_scale", "real", 0, "part of a distance that is safe"),
        Field(
            "exact_normals", "int", 0, "1: normals are the formula's own; 0: of planes through the surface"
        ),
    ],
)

EXTENT = Struct(
    "Extent",
    [
        Field("bricks", "int", 3, "evaluated bricks along x, y and z"),
        Field("last", "int", 3, "the grid's last voxel along x, y and z"),
        Field("first_layer", "int", 0, "the grid's layer of voxels that a slab begins with"),
        Field("whole", "float", 0, "least value of a voxel that is inside as a whole"),
        Field("opaque", "float", 0, "least value of a voxel that counts as inside"),
        Field("floats", "int", 0, "1: values are stored as floats; 0: as bytes"),
        Field("scale", "float", 0, "factor from a voxel's value to what is stored"),
        Field(
            "normal_x",
            "float",
            3,
            "what a difference of values along the grid's x adds to a gradient in the scene",
        ),
        Field("normal_y", "float", 3, ""),
        Field("normal_z", "float", 3, ""),
    ],
)


@dataclass(frozen=True, slots=True)
class Lattice:
    """The points of a grid: voxel (i, j, k) has its middle at corner + (i + 0.5, j + 0.5, k + 0.5) * spacing.

    Attributes:
        corner: the least corner of the box, scene units.
        spacing: sides of a voxel, scene units.
        shape: voxels along x, y and z.
    """

    corner: Vector
    spacing: Vector
    shape: Shape

    @property
    def bricks(self) -> Shape:
        """Stored bricks along x, y and z."""
        return bricks_of(self.shape)

    @property
    def evaluated_bricks(self) -> Shape:
        """Bricks of 8 voxels along x, y and z."""
        return evaluated_bricks_of(self.shape)

    @property
    def place(self) -> GridPlace:
        """The same as any grid's place."""
        return GridPlace.along_axes(self.corner, self.spacing, self.shape)

    def axes(self, precision: Precision, sub_points: int = 1) -> npt.NDArray[Any]:
        """Coordinates of voxels' points: all x, then y, then z, each sub-point's after the other's.

        Found in float64 and rounded once. Along each axis the last voxel repeats up to whole bricks.
        """
        rows = []
        inside = (np.arange(sub_points) + 0.5) / sub_points
        padded = tuple(BRICK * n for n in self.evaluated_bricks)
        for corner, spacing, n, length in zip(self.corner, self.spacing, self.shape, padded, strict=True):
            voxel = np.minimum(np.arange(length), n - 1)
            rows += [corner + (voxel + part) * spacing for part in inside]
        return np.concatenate(rows).astype(precision)

    def record(
        self, precision: Precision, sub_points: int, step_scale: float, *, exact_normals: bool = False
    ) -> np.ndarray[Any, np.dtype[np.void]]:
        """The struct of the kernels that evaluate voxels."""
        reach = 0.5 * (1 - 1 / sub_points)
        values = {
            "last": [n - 1 for n in self.shape],
            "padded": [BRICK * n for n in self.evaluated_bricks],
            "sub_points": sub_points,
            "margin": [reach * spacing for spacing in self.spacing],
            "middle_offset": [reach * spacing for spacing in self.spacing],
            "side": min(self.spacing),
            "step_scale": step_scale,
            "exact_normals": int(exact_normals),
        }
        return LATTICE.value(precision, values)


def bricks_of(shape: Shape) -> Shape:
    """Stored bricks along the axes of a grid: each spans 8 cells between middles of voxels."""
    x, y, z = ((n + BRICK - 2) // BRICK for n in shape)
    return max(x, 1), max(y, 1), max(z, 1)


def evaluated_bricks_of(shape: Shape) -> Shape:
    """Bricks of 8 voxels, each voxel in one: one more along an axis where the last layer is only shared."""
    x, y, z = (-(-n // BRICK) for n in shape)
    return x, y, z


def lattice_of(box: Box, resolution: int | Shape) -> Lattice:
    """The voxels of a box: cubes, `resolution` of them along the longest side, or as many as given along each.

    Of cubes the other sides get as many as cover them, 2 at least, and the box grows about its middle to whole voxels.
    """
    sides = box.sides
    if isinstance(resolution, tuple):
        x, y, z = (side / n for side, n in zip(sides, resolution, strict=True))
        spacing, shape = (x, y, z), resolution
    else:
        cube = max(sides) / resolution
        # A side that is a whole number of voxels but for rounding is one.
        nx, ny, nz = (min(max(int(np.ceil(side / cube * (1 - 1e-9))), 2), MAX_RESOLUTION) for side in sides)
        spacing, shape = (cube, cube, cube), (nx, ny, nz)
    x, y, z = (c - 0.5 * n * s for c, n, s in zip(box.center, shape, spacing, strict=True))
    return Lattice((x, y, z), spacing, shape)


def pack_places(x: npt.ArrayLike, y: npt.ArrayLike, z: npt.ArrayLike) -> Places:
    """Places of bricks or nodes as the kernels read them: 21 bits each, x lowest."""
    parts = [np.asarray(part, np.uint64) for part in (x, y, z)]
    return np.asarray(parts[0] | parts[1] << np.uint64(21) | parts[2] << np.uint64(42))


def unpack_places(places: Places) -> npt.NDArray[np.int64]:
    """x, y, z of places, shape (n, 3)."""
    mask = np.uint64(0x1FFFFF)
    parts = [places & mask, places >> np.uint64(21) & mask, places >> np.uint64(42)]
    return np.stack(parts, axis=1).astype(np.int64)


def all_places(shape: Shape) -> Places:
    """Every place of a block, x fastest."""
    z, y, x = np.indices(shape[::-1], np.uint64).reshape(3, -1)
    return pack_places(x, y, z)
