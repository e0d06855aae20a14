"""What stored bricks hold: the parts that may be visible, and the range of their values."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.voxels.grid import Grid
from clfractal.voxels.programs import Recipe, blocks_recipe, build_all, ranges_recipe

BLOCK_BYTES = 8
RANGE_BYTES = 8


def seen_blocks(grid: Grid, unseen: float, on_compile: Callable[[str], None] | None = None) -> cl.Buffer:
    """A bit for each block of 2 x 2 x 2 cells of each slot: whether any of its 27 samples is above `unseen`.

    Args:
        grid: the grid.
        unseen: as samples are kept, 0 to 255 of `byte`. A sample that is not a number counts as above.
        on_compile: called with a message if the program is compiled first.

    Returns:
        Eight bytes a slot, on the grid's device: for each octant of 4 x 4 x 4 cells, x fastest, then y, then z, a byte
        whose bits are its blocks in the same order.

    Raises:
        DeviceError: status 2 if there is no room, 3 if the device failed.
        KernelBuildError: the program does not compile.
    """
    doing, what = "checking the grid's bricks", "the table of visible blocks"
    return _table(grid, blocks_recipe(), BLOCK_BYTES, doing, what, on_compile, np.float32(unseen))


def brick_ranges(grid: Grid, on_compile: Callable[[str], None] | None = None) -> npt.NDArray[np.float32]:
    """The least and the largest sample of each slot, as samples are kept; shape (slots, 2), infinite where one is NaN.

    Raises:
        DeviceError: status 2 if there is no room, 3 if the device failed.
        KernelBuildError: the program does not compile.
    """
    doing = "reading the grid's bricks"
    ranges = _table(grid, ranges_recipe(), RANGE_BYTES, doing, "the ranges of bricks", on_compile)
    found = np.empty((grid.parts.slots, 2), np.float32)
    with grid.device.failures(doing):
        cl.enqueue_copy(grid.device.queue, found, ranges)
    ranges.release()
    return found


def _table(
    grid: Grid,
    recipe: Recipe,
    nbytes: int,
    doing: str,
    what: str,
    on_compile: Callable[[str], None] | None,
    *more: np.generic,
) -> cl.Buffer:
    """What a kernel finds of each slot, so many bytes.

    Args:
        doing, what: for messages.
        more: the last arguments of the kernel.
    """
    device, floats = grid.device, np.int32(grid.kind == "float")
    built = build_all(device, [recipe], on_compile)[0]
    found = device.buffer(nbytes * grid.parts.slots, what)
    for values, (first, after) in zip(grid.values, grid.parts.ranges(), strict=True):
        numbers = map(np.int32, (0, after - first, first))
        built.run(device, doing, [found, values, *numbers, floats, *more], 2, after - first, first_part=4096)
    return found
