"""Records that kernels read while they run, so that the host can end launches that would take too long.

OpenCL has no way to end a launch. Where host and device share their memory, as processors do, a kernel sees what the host
writes into a buffer that lies in the host's own memory. Elsewhere the record is an ordinary one, and launches are only as
short as they are made.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.quirks import sees_host_writes
from clfractal.device.select import Device

CANCELLED = "cancelled"
"""The field of a struct that kernels read."""

# Alignment that drivers need to use host memory directly.
_ALIGNMENT = 4096


def is_watched(record: npt.NDArray[Any]) -> bool:
    """Whether kernels read records of this kind while they run."""
    return CANCELLED in (record.dtype.names or ())


class Watched:
    """Records on a device, in `buffer`, by which kernels that read them are asked to end."""

    def __init__(self, device: Device, records: npt.NDArray[Any]) -> None:
        nbytes = -(-records.nbytes // _ALIGNMENT) * _ALIGNMENT
        memory = np.zeros(nbytes + _ALIGNMENT, np.uint8)
        first = -memory.ctypes.data % _ALIGNMENT
        self._bytes = memory[first : first + nbytes]
        self._bytes[: records.nbytes] = np.ascontiguousarray(records).reshape(-1).view(np.uint8)
        self._records = self._bytes[: records.nbytes].view(records.dtype)
        self._shared = sees_host_writes(device.info)
        flags = cl.mem_flags.USE_HOST_PTR if self._shared else cl.mem_flags.COPY_HOST_PTR
        with device.failures("uploading constants"):
            self.buffer = cl.Buffer(device.context, cl.mem_flags.READ_ONLY | flags, hostbuf=self._bytes)

    def cancel(self, cancelled: bool) -> None:
        """Asks kernels that read the records to end, or takes that back."""
        if self._shared:
            self._records[CANCELLED] = int(cancelled)

    def put(self, queue: cl.CommandQueue, records: npt.NDArray[Any]) -> None:
        """Replaces the first records, when no kernel reads them; behind what is in the queue where memory is not shared."""
        data = np.ascontiguousarray(records).reshape(-1).view(np.uint8)
        if self._shared:
            self._bytes[: data.nbytes] = data
        else:
            cl.enqueue_copy(queue, self.buffer, data)
