"""Memory for bricks on a device: one buffer, or up to four where one would be too large."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.select import Device
from clfractal.voxels.lattice import BRICK_STRIDE

MOST_PARTS = 4


@dataclass(frozen=True, slots=True)
class Parts:
    """How slots are spread over the parts of a pool.

    Attributes:
        slots: slots of all parts together.
        part_slots: slots of every part but the last.
    """

    slots: int
    part_slots: int

    @property
    def count(self) -> int:
        """Buffers of a pool."""
        return -(-self.slots // self.part_slots)

    def ranges(self) -> Iterator[tuple[int, int]]:
        """First slot of each part, and the one after its last."""
        for part in range(self.count):
            first = part * self.part_slots
            yield first, min(first + self.part_slots, self.slots)


def plan_pools(device: Device, slots: int, sample_bytes: tuple[int, ...], others: int, what: str) -> Parts:
    """The parts of pools of `slots` bricks whose samples take `sample_bytes` each, beside `others` bytes.

    Raises:
        DeviceError: status 2, with the memory needed and available, when they do not fit.
    """
    slots = max(slots, 1)
    largest = BRICK_STRIDE * max(sample_bytes)
    device.check_memory(slots * BRICK_STRIDE * sum(sample_bytes) + others, what)
    in_one = device.info.max_alloc // largest
    if slots <= in_one:
        return Parts(slots, slots)
    device.check_memory(0, what, largest=-(-slots // MOST_PARTS) * largest)
    return Parts(slots, in_one)


def allocate(device: Device, parts: Parts, sample_bytes: int, what: str) -> tuple[cl.Buffer, ...]:
    """The buffers of a pool."""
    return tuple(
        device.buffer((after - first) * BRICK_STRIDE * sample_bytes, what) for first, after in parts.ranges()
    )


def upload(
    device: Device,
    array: npt.NDArray[Any],
    what: str = "a grid's constants",
    doing: str = "uploading constants",
) -> cl.Buffer:
    """A buffer with an array's bytes; `what` and `doing` for messages."""
    data = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    buffer = device.buffer(max(data.nbytes, 16), what, read_only=True)
    if data.nbytes:
        with device.failures(doing):
            cl.enqueue_copy(device.queue, buffer, data)
    return buffer
