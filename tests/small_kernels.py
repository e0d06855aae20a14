"""Small kernels over the engine's headers: built for one number type and lane count, and run on planes of numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device import compiler, program
from clfractal.device.select import Device, is_pocl
from clfractal.device.source import flatten
from clfractal.device.structs import Precision
from clfractal.errors import KernelBuildError

Floats = npt.NDArray[np.floating[Any]]

LOADS = """\
INLINE real load(__global const scalar *from) {
    scalar each[LANES];
    for (int lane = 0; lane < LANES; ++lane) each[lane] = from[lane];
    return lanes_load(each);
}
INLINE void store(__global scalar *to, real value) {
    scalar each[LANES];
    lanes_store(value, each);
    for (int lane = 0; lane < LANES; ++lane) to[lane] = each[lane];
}
"""
"""What kernels read and write their packets by, behind "formulas/numbers/real.h" or "device/vectors.h"."""


def _built(device: Device, text: str, flags: Sequence[str]) -> Any:
    """The program of a text: PoCL's files go into the cache, as those of the program's own texts do, so the next run of the
    tests compiles nothing. Other drivers would be asked for a binary, for which they compile every kernel once more."""
    if not is_pocl(device.info):
        return compiler.compile_source(device, text, flags)
    try:
        return program.build(device, text, flags=flags, isolated=False).cl_program
    except KernelBuildError as error:
        raise compiler.BuildFailureError(error.details) from None


class SmallKernels:
    """The program of a text; BuildFailureError with the log if it does not compile."""

    def __init__(
        self,
        device: Device,
        text: str,
        precision: Precision,
        lanes: int,
        *,
        generated: Mapping[str, str] | None = None,
        defines: Mapping[str, object] | None = None,
        flags: Sequence[str] = (),
    ) -> None:
        self.device, self.precision, self.lanes = device, precision, lanes
        flat = flatten(
            "small.cl",
            generated={"small.cl": text, **(generated or {})},
            defines={"LANES": lanes, "REAL_IS_DOUBLE": int(precision == "float64"), **(defines or {})},
        )
        self._program = _built(device, flat.text, [*program.math_flags(precision), *flags])

    def planes(self, numbers: npt.NDArray[Any], fill: float = 0.0) -> Floats:
        """Numbers of shape (..., n) in the kernels' type, with n filled up to whole packets."""
        *outer, given = numbers.shape
        found = np.full((*outer, -(-given // self.lanes) * self.lanes), fill, self.precision)
        found[..., :given] = numbers
        return found

    def scalars(self, numbers: Sequence[float] | Floats) -> list[Any]:
        """Arguments of the kernels' type."""
        return [np.dtype(self.precision).type(number) for number in numbers]

    def run(
        self, name: str, *arguments: npt.NDArray[Any] | np.generic, result: npt.NDArray[Any], rows: int = 1
    ) -> npt.NDArray[Any]:
        """Runs a kernel for each packet of the last axis of `result`, which is one of its arguments and is filled.

        Args:
            arguments: arrays become buffers, numbers of NumPy are handed over as they are.
            rows: size of the second dimension of the launch.
        """
        flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
        buffers = {
            number: cl.Buffer(
                self.device.context, flags, hostbuf=np.ascontiguousarray(each).reshape(-1).view(np.uint8)
            )
            for number, each in enumerate(arguments)
            if isinstance(each, np.ndarray)
        }
        (place,) = (number for number, each in enumerate(arguments) if each is result)
        kernel = cl.Kernel(self._program, name)
        kernel.set_args(*(buffers.get(number, each) for number, each in enumerate(arguments)))
        # Work-groups of one: the cheapest to compile for.
        cl.enqueue_nd_range_kernel(self.device.queue, kernel, (result.shape[-1] // self.lanes, rows), (1, 1))
        cl.enqueue_copy(self.device.queue, result, buffers[place])
        return result
