"""How far two grids of the same voxels differ."""

from __future__ import annotations

import numpy as np

from clfractal.voxels.grid import Grid


def differing_voxels(first: Grid, second: Grid) -> int:
    """How many voxels of two grids have different values, as of a fill by octree and a brute one.

    Raises:
        ValueError: the grids' shapes differ.
    """
    if first.shape != second.shape:
        raise ValueError(f"grids of {first.shape} and {second.shape} voxels cannot be compared")
    return int(np.count_nonzero(first.dense() != second.dense()))
