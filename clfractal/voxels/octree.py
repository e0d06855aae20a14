"""The octree over a grid: finding the bricks that may hold something, and how far there is nothing around a brick."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from clfractal.voxels.lattice import Lattice, Places, Shape, all_places, pack_places, unpack_places

# Nodes to begin with: too few leave a device idle, and large nodes are seldom empty.
MOST_FIRST_NODES = 4096
FIRST_LEVEL = 3


def descend(lattice: Lattice, empty: Callable[[Places, int], npt.NDArray[np.bool_]]) -> tuple[Places, int]:
    """The bricks of a grid that are not shown to be empty, and how many nodes were looked at.

    Args:
        lattice: the grid.
        empty: tells of nodes, `cells` voxels a side, which of them hold nothing.

    Returns:
        Places among the evaluated bricks, those of one node beside each other.
    """
    bricks = lattice.evaluated_bricks
    level = FIRST_LEVEL
    while int(np.prod([-(-n >> level) for n in bricks])) > MOST_FIRST_NODES:
        level += 1
    nodes = all_places(_halved(bricks, level))
    looked = 0
    while True:
        looked += len(nodes)
        nodes = nodes[~empty(nodes, 8 << level)]
        if level == 0:
            return nodes, looked
        level -= 1
        nodes = _children(nodes, _halved(bricks, level))


def levels(table: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """The table with how far there is nothing: -(1 + level) in place of each negative entry.

    Args:
        table: entries of bricks, shape (bz, by, bx); a negative one is of a brick that cannot be seen.

    Returns:
        A new table. `level` is the largest for which all bricks of the node of 1 << level bricks a side that the brick
        is in cannot be seen; nodes are aligned to multiples of their size, and nothing is past the grid's ends.
    """
    pyramid = [table < 0]
    while max(pyramid[-1].shape) > 1 and pyramid[-1].any():
        pyramid.append(_eighth(pyramid[-1]))
    found = np.full(pyramid[-1].shape, -1, np.int8)
    for level in range(len(pyramid) - 1, -1, -1):
        here = pyramid[level]
        if level < len(pyramid) - 1:
            for axis in range(3):
                found = np.repeat(found, 2, axis=axis)
            found = found[tuple(slice(n) for n in here.shape)]
        found = np.where(found >= 0, found, np.where(here, np.int8(level), np.int8(-1)))
    return np.where(found >= 0, -1 - found.astype(np.int32), table)


def _eighth(empty: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Whether all of each 2 x 2 x 2 are empty."""
    for axis in range(3):
        first, second = (
            empty[tuple(slice(start, None, 2) if axis == a else slice(None) for a in range(3))]
            for start in (0, 1)
        )
        whole = first.copy()
        whole[tuple(slice(n) for n in second.shape)] &= second
        empty = whole
    return empty


def _halved(bricks: Shape, level: int) -> Shape:
    x, y, z = (-(-n >> level) for n in bricks)
    return x, y, z


def _children(nodes: Places, shape: Shape) -> Places:
    """The nodes of half the size within the grid, of `shape` such nodes."""
    offsets = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    places = (2 * unpack_places(nodes)[:, None, :] + offsets).reshape(-1, 3)
    places = places[(places < np.array(shape)).all(axis=1)]
    return pack_places(places[:, 0], places[:, 1], places[:, 2])
