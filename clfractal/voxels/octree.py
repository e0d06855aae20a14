"""The octree over a grid: finding the bricks that may hold something, and how far there is nothing around a brick."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.voxels.lattice import BRICK, Lattice, Places, Shape, all_places, pack_places, unpack_places

# Nodes to begin with: too few leave a device idle, and large nodes are seldom empty.
MOST_FIRST_NODES = 4096
FIRST_LEVEL = 3
# As in `kernels/voxels_nodes.cl`.
UNDECIDED, EMPTY, FULL = 0, 1, 2


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """The bricks of a grid after going down its octree.

    Attributes:
        open: places of bricks that are not decided, those of one node beside each other.
        full: places of bricks that are inside as a whole, their ninth layer included.
        looked: how many nodes were looked at.
    """

    open: Places
    full: Places
    looked: int


def descend(lattice: Lattice, classify: Callable[[Places, int], npt.NDArray[np.uint8]]) -> Descent:
    """Goes down the octree over a grid's evaluated bricks.

    Args:
        lattice: the grid.
        classify: tells of nodes, `cells` voxels a side, whether they are UNDECIDED, EMPTY or FULL.
    """
    bricks = lattice.evaluated_bricks
    level = FIRST_LEVEL
    while int(np.prod(_halved(bricks, level))) > MOST_FIRST_NODES:
        level += 1
    nodes, looked = all_places(_halved(bricks, level)), 0
    full = np.zeros(0, np.uint64)
    while True:
        looked += len(nodes)
        classes = classify(nodes, BRICK << level)
        full = np.append(full, nodes[classes == FULL])
        nodes = nodes[classes == UNDECIDED]
        if level == 0:
            return Descent(nodes, full, looked)
        level -= 1
        nodes, full = (_children(each, _halved(bricks, level)) for each in (nodes, full))


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


def touched(flags: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Which bricks are flagged, or touch one that is, if only at a corner."""
    for axis in range(3):
        before, after = (
            tuple(slice(start, stop) if axis == a else slice(None) for a in range(3))
            for start, stop in ((None, -1), (1, None))
        )
        grown = flags.copy()
        grown[before] |= flags[after]
        grown[after] |= flags[before]
        flags = grown
    return flags


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
    x, y, z = (-(-n // (1 << level)) for n in bricks)
    return x, y, z


def _children(nodes: Places, shape: Shape) -> Places:
    """The nodes of half the size within the grid, of `shape` such nodes."""
    offsets = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    places = (2 * unpack_places(nodes)[:, None, :] + offsets).reshape(-1, 3)
    places = places[(places < np.array(shape)).all(axis=1)]
    return pack_places(places[:, 0], places[:, 1], places[:, 2])
