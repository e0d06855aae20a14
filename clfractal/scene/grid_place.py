"""Where a grid is in the scene: an affine map, for turned, oblique and mirrored grids too."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from clfractal.scene.stance import Extent
from clfractal.schema.base import Vector, length

Doubles: TypeAlias = npt.NDArray[np.float64]
Steps: TypeAlias = tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True)
class GridPlace:
    """The place of a grid.

    The grid's own coordinates (i, j, k) count voxels from its first corner, so the middles of voxels are at i + 0.5,
    j + 0.5, k + 0.5. In the scene they are at corner + i * steps[0] + j * steps[1] + k * steps[2].

    Attributes:
        corner: the outer corner of the first voxel, scene units.
        steps: from a voxel to the next along the grid's own axes, scene units. They need not stand at right angles, nor
            be right-handed, but they span a volume.
        shape: voxels along the grid's own axes.
    """

    corner: Vector
    steps: Steps
    shape: tuple[int, int, int]

    @classmethod
    def along_axes(cls, corner: Vector, spacing: Vector, shape: tuple[int, int, int]) -> GridPlace:
        """The place of a grid along the scene's axes, whose voxels have these sides."""
        x, y, z = spacing
        return cls(corner, ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)), shape)

    @property
    def spacing(self) -> Vector:
        """Sides of a voxel along the grid's own axes, scene units."""
        x, y, z = (length(step) for step in self.steps)
        return x, y, z

    @property
    def edges(self) -> Doubles:
        """The grid's own sides as vectors from its first corner, scene units; shape (3, 3), one in each row."""
        found: Doubles = np.array(self.steps) * np.array(self.shape)[:, None]
        return found

    @property
    def middle(self) -> Doubles:
        """Of the grid, scene units."""
        found: Doubles = np.array(self.corner) + self.edges.sum(axis=0) / 2
        return found

    @property
    def first_voxel(self) -> Doubles:
        """The middle of the first voxel, scene units."""
        found: Doubles = np.array(self.corner) + np.array(self.steps).sum(axis=0) / 2
        return found

    @property
    def ends(self) -> Doubles:
        """The eight corners, scene units; shape (8, 3)."""
        return np.array(self.corner) + _CORNERS @ self.edges

    @property
    def box(self) -> Doubles:
        """Sides of the box along the scene's axes that the grid just fits into, scene units; shape (3,)."""
        found: Doubles = np.abs(self.edges).sum(axis=0)
        return found

    @property
    def diagonal(self) -> float:
        """The longest way through the grid, scene units."""
        return float(np.linalg.norm(_DIAGONALS @ self.edges, axis=1).max())

    @property
    def inverse(self) -> Doubles:
        """From the scene to the grid; shape (3, 3): row i times (point - corner) is the grid's own coordinate i."""
        lengths = np.array(self.spacing)
        # (Of unit vectors: so the steps' lengths are no part of the matrix's condition.)
        found: Doubles = np.linalg.inv(np.array(self.steps) / lengths[:, None]).T / lengths[:, None]
        return found

    @property
    def extent(self) -> Extent:
        """What a camera frames that is to show all of the grid."""
        return Extent.block(vector_of(self.middle), [vector_of(edge) for edge in self.edges])

    def own(self, points: npt.ArrayLike) -> Doubles:
        """The grid's own coordinates of points of the scene, shape (..., 3)."""
        return (np.asarray(points, float) - self.corner) @ self.inverse.T

    def moved(self, middle: npt.ArrayLike, factor: float = 1.0) -> GridPlace:
        """The same grid with its middle at a point of the scene, and larger by a factor."""
        x, y, z = (vector_of(row) for row in np.array(self.steps) * factor)
        half = self.edges.sum(axis=0) * factor / 2
        return GridPlace(vector_of(np.asarray(middle, float) - half), (x, y, z), self.shape)


_CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], float)
_DIAGONALS = np.array([[1, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1]], float)


def vector_of(array: Doubles) -> Vector:
    """Three numbers of an array."""
    x, y, z = array.tolist()
    return x, y, z
