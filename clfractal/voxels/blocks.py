"""What stored bricks hold: the parts that may be visible, and the range of their values."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.launch import run_in_parts
from clfractal.voxels.grid import Grid
from clfractal.voxels.programs import blocks_recipe, build_all, ranges_recipe

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
    device, floats = grid.device, np.int32(grid.kind == "float")
    built = build_all(device, [blocks_recipe()], on_compile)[0]
    blocks = device.buffer(BLOCK_BYTES * grid.parts.slots, "the table of visible blocks")
    for values, (first, after) in zip(grid.values, grid.parts.ranges(), strict=True):
        with device.failures("checking the grid's bricks"):
            built.kernel.set_args(
                blocks,
                values,
                np.int32(0),
                np.int32(after - first),
                np.int32(first),
                floats,
                np.float32(unseen),
            )
        run_in_parts(
            device,
            built.kernel,
            2,
            after - first,
            doing="checking the grid's bricks",
            group=built.group,
            first_part=4096,
        )
    return blocks


def brick_ranges(grid: Grid, on_compile: Callable[[str], None] | None = None) -> npt.NDArray[np.float32]:
    """The least and the largest sample of each slot, as samples are kept; shape (slots, 2), infinite where one is NaN.

    Raises:
        DeviceError: status 2 if there is no room, 3 if the device failed.
        KernelBuildError: the program does not compile.
    """
    device, floats = grid.device, np.int32(grid.kind == "float")
    built = build_all(device, [ranges_recipe()], on_compile)[0]
    ranges = device.buffer(RANGE_BYTES * grid.parts.slots, "the ranges of bricks")
    for values, (first, after) in zip(grid.values, grid.parts.ranges(), strict=True):
        with device.failures("reading the grid's bricks"):
            built.kernel.set_args(
                ranges, values, np.int32(0), np.int32(after - first), np.int32(first), floats
            )
        run_in_parts(
            device,
            built.kernel,
            2,
            after - first,
            doing="reading the grid's bricks",
            group=built.group,
            first_part=4096,
        )
    found = np.empty((grid.parts.slots, 2), np.float32)
    with device.failures("reading the grid's bricks"):
        cl.enqueue_copy(device.queue, found, ranges)
    ranges.release()
    return found
