"""Asks a device whether its compiler lays structs out as NumPy does."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pyopencl as cl

from clfractal.device.program import build, math_flags
from clfractal.device.select import Device
from clfractal.device.structs import Precision, Struct
from clfractal.errors import DeviceError


def verify(device: Device, structs: Iterable[Struct], precision: Precision) -> None:
    """Compare size and offsets of every struct on the device with those of its NumPy dtype.

    The kernel is made of the very text that programs are made of. (`pyopencl.tools.match_dtype_to_c_struct`
    asks the same of a text of its own; the tests compare the two.)

    Raises:
        DeviceError: status 3, they differ.
    """
    checked = tuple(structs)
    text = program_text(checked, precision)
    program = build(device, text, flags=math_flags(precision), isolated=False)
    expected = np.concatenate([_layout(struct, precision) for struct in checked])
    found = np.empty_like(expected)
    kernel = program.kernel("layout")
    with device.failures("checking the layout of structs"):
        flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
        buffer = cl.Buffer(device.context, flags, hostbuf=np.zeros_like(expected))
        kernel.set_args(buffer)
        cl.enqueue_nd_range_kernel(device.queue, kernel, (1,), (1,))
        cl.enqueue_copy(device.queue, found, buffer)
    if not np.array_equal(found, expected):
        raise DeviceError(
            f"{device.info.name}: the driver lays out structs differently from C",
            details=f"expected sizes and offsets {expected.tolist()}, found {found.tolist()}",
        )


def _layout(struct: Struct, precision: Precision) -> np.typing.NDArray[np.uint32]:
    dtype = struct.dtype(precision)
    fields: Mapping[str, Any] = dtype.fields or {}
    return np.array([dtype.itemsize, *(fields[name][1] for name in dtype.names or ())], np.uint32)


def program_text(structs: Iterable[Struct], precision: Precision) -> str:
    """A kernel that writes size and offsets of each struct."""
    lines = ["#pragma OPENCL EXTENSION cl_khr_fp64 : enable"] if precision == "float64" else []
    lines += [struct.c_text(precision) for struct in structs]
    lines += ["__kernel void layout(__global uint *out) {", "    int next = 0;"]
    for number, struct in enumerate(structs):
        value = f"s{number}"
        lines.append(f"    __private struct {struct.name} {value};")
        lines.append(f"    out[next++] = (uint)sizeof({value});")
        start = f"(__private const char *)&{value}"
        lines += [
            f"    out[next++] = (uint)((__private const char *)&{value}.{field.name} - {start});"
            for field in struct.fields
        ]
    return "\n".join([*lines, "}"]) + "\n"
