"""The octree over a grid: which bricks may hold something, and how far around others is nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.voxels.lattice import BRICK, Lattice, Places, Shape, all_places, pack_places, unpack_places

# Nodes to begin with: too few leave a device idle, and large nodes are seldom empty.
MOST_FIRST_NODES = 4096
FIRST_LEVEL = 3
# The octants of directions in which z, y or x falls, a bit each.
FALLING = (np.uint8(0xF0), np.uint8(0xCC), np.uint8(0xAA))
MOST_SIDE = 7
# As in `kernels/voxels/voxels_nodes.cl`.
UNDECIDED, EMPTY, FULL = 0, 1, 2


@dataclass(frozen=True, slots=True, eq=False)
class Descent:
    """The bricks of a grid after going down its octree.

    Attributes:
        open: places of bricks that are not decided, those of one node beside each other.
        full: places of bricks that are inside as a whole, their ninth layer included.
        looked: how many nodes were checked.
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


def empty_cubes(table: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """The table with how far there is nothing: -(1 + sides) in place of each negative entry.

    Rays of an octant of directions never turn back, so that only what lies ahead of them counts.

    Args:
        table: entries of bricks, shape (bz, by, bx); a negative one is of a brick that cannot be seen.

    Returns:
        A new table. `sides` tells for each octant of directions the largest k <= 7 for which no brick can be seen of the
        cube of 1 << k bricks a side that begins with the brick and lies in these directions: bits i, i + 8 and i + 16 are
        its lowest, middle and highest digit, where of i the lowest bit is set if x falls, then y, then z. Nothing is past
        the grid's ends.
    """
    # A bit for each octant: whether the cube is empty. Eight cubes of half its side make up the next.
    empty = np.where(table < 0, np.uint8(255), np.uint8(0))
    digits = [np.zeros_like(empty) for _ in range(3)]
    beside = np.empty_like(empty)
    for level in range(MOST_SIDE):
        half = 1 << level
        if half >= max(table.shape) or not empty.any():
            break
        for axis, falling in enumerate(FALLING):
            if half >= table.shape[axis]:
                continue
            # Shifted as a whole, which is quick; what comes from other rows is past the grid's ends.
            shift = half * int(np.prod(table.shape[axis + 1 :]))
            flat, other = empty.reshape(-1), beside.reshape(-1)
            before = empty.copy()
            other[:-shift] = flat[shift:]
            np.swapaxes(beside, 0, axis)[-half:] = 255
            beside |= falling
            empty &= beside
            other[shift:] = before.reshape(-1)[:-shift]
            np.swapaxes(beside, 0, axis)[:half] = 255
            beside |= ~falling
            empty &= beside
        carry = empty.copy()
        for digit in digits:
            digit ^= carry
            carry &= ~digit
    sides = digits[0].astype(np.int32)
    sides |= digits[1].astype(np.int32) << 8
    sides |= digits[2].astype(np.int32) << 16
    return np.where(table < 0, ~sides, table)


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


def _halved(bricks: Shape, level: int) -> Shape:
    x, y, z = (-(-n // (1 << level)) for n in bricks)
    return x, y, z


def _children(nodes: Places, shape: Shape) -> Places:
    """The nodes of half the size within the grid, of `shape` such nodes."""
    offsets = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    places = (2 * unpack_places(nodes)[:, None, :] + offsets).reshape(-1, 3)
    places = places[(places < np.array(shape)).all(axis=1)]
    return pack_places(places[:, 0], places[:, 1], places[:, 2])
