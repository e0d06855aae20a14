"""What a driver's failure says: its status, and whether memory is short."""

from __future__ import annotations

from typing import Any

import pyopencl as cl


def is_out_of_memory(error: cl.Error) -> bool:
    """Whether a failure means that memory is short: drivers use any of four codes for it."""
    status = cl.status_code
    return error_number(error) in {
        status.MEM_OBJECT_ALLOCATION_FAILURE,
        status.OUT_OF_RESOURCES,
        status.OUT_OF_HOST_MEMORY,
        status.INVALID_BUFFER_SIZE,
    }


def error_number(error: cl.Error) -> int:
    """The OpenCL status code of a failure."""
    return int(getattr(error, "code", 0))


def error_code(error: cl.Error) -> str:
    """Routine and status of a failure as one short text, e.g. `clEnqueueNDRangeKernel: OUT_OF_RESOURCES`."""
    routine = getattr(error, "routine", "") or "OpenCL"
    return f"{routine}: {status_name(error_number(error))}"


def status_name(number: int) -> str:
    """The name of an OpenCL status code, such as `OUT_OF_RESOURCES`."""
    to_string: Any = cl.status_code.to_string
    return str(to_string(number, "status %d"))
