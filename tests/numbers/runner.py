"""Runs every operation of a number type in one generated kernel: an index chooses the operation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyopencl as cl

from clfractal.device import compiler, program
from clfractal.device.select import Device
from clfractal.device.source import flatten
from clfractal.device.structs import Precision
from tests.numbers.arguments import Floats

_HEAD = """\
#include "lanes.h"
#include "numbers/real.h"
#include "numbers/dual.h"
#include "vectors.h"

INLINE real load_lanes(__global const scalar *from) {
    scalar each[LANES];
    for (int lane = 0; lane < LANES; ++lane) each[lane] = from[lane];
    return lanes_load(each);
}
INLINE void store_lanes(__global scalar *to, real value) {
    scalar each[LANES];
    lanes_store(value, each);
    for (int lane = 0; lane < LANES; ++lane) to[lane] = each[lane];
}
INLINE dual load_dual(real value, __global const scalar *partials, int count) {
    const dual r = {value, load_lanes(partials), load_lanes(partials + count),
                    load_lanes(partials + 2 * count)};
    return r;
}

"""

_KERNEL = """\
__kernel void @_operations(__global const scalar *arguments, __global const scalar *partials,
                           __global scalar *results, int count) {
    const int lane = (int)get_global_id(0) * LANES, index = (int)get_global_id(1);
    const real a = load_lanes(arguments + 3 * index * count + lane);
    const real b = load_lanes(arguments + (3 * index + 1) * count + lane);
    const real c = load_lanes(arguments + (3 * index + 2) * count + lane);
    const dual A = load_dual(a, partials + lane, count), B = load_dual(b, partials + 3 * count + lane, count),
               C = load_dual(c, partials + 6 * count + lane, count);
    @ r;
    switch (index) {
$cases
    default: return;
    }
$stores
}
"""


def _kernel(number_type: str, calls: Sequence[str]) -> str:
    cases = "\n".join(f"    case {index}: r = {call}; break;" for index, call in enumerate(calls))
    outputs = ["r"] if number_type == "real" else ["r.v", "r.dx", "r.dy", "r.dz"]
    stores = "\n".join(
        f"    store_lanes(results + ({len(outputs)} * index + {place}) * count + lane, {output});"
        for place, output in enumerate(outputs)
    )
    return _KERNEL.replace("@", number_type).replace("$cases", cases).replace("$stores", stores)


class Runner:
    """The program of both number types for one lane count and precision."""

    def __init__(
        self, device: Device, precision: Precision, lanes: int, real: Sequence[str], dual: Sequence[str]
    ) -> None:
        self.device, self.precision, self.lanes = device, precision, lanes
        flat = flatten(
            "operations.cl",
            generated={"operations.cl": _HEAD + _kernel("real", real) + _kernel("dual", dual)},
            defines={"LANES": lanes, "REAL_IS_DOUBLE": int(precision == "float64")},
        )
        # Without the cache: asking for a binary makes drivers compile every kernel once more.
        self.program = compiler.compile_source(device, flat.text, program.math_flags(precision))

    def run(self, number_type: str, arguments: Floats, partials: Floats) -> Floats:
        """Results of shape (operations, planes, count): the value, and of duals the three partials.

        `arguments` has the shape (operations, 3, count), `partials` (9, count).
        """
        count = arguments.shape[-1]
        planes = 1 if number_type == "real" else 4
        result = np.empty((len(arguments), planes, count), self.precision)
        buffers = [self._upload(arguments), self._upload(partials), self._upload(result)]
        kernel = cl.Kernel(self.program, f"{number_type}_operations")
        kernel.set_args(*buffers, np.int32(count))
        queue = self.device.queue
        cl.enqueue_nd_range_kernel(queue, kernel, (count // self.lanes, len(arguments)), (1, 1))
        cl.enqueue_copy(queue, result, buffers[2])
        return result

    def _upload(self, array: Floats) -> cl.Buffer:
        flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
        return cl.Buffer(self.device.context, flags, hostbuf=np.ascontiguousarray(array))
