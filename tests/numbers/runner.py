"""Runs every operation of a number type in one generated kernel: an index chooses the operation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from tests.numbers.arguments import Floats
from tests.small_kernels import LOADS, SmallKernels

_HEAD = """\
#include "device/lanes.h"
#include "formulas/numbers/real.h"
#include "formulas/numbers/powers.h"
#include "device/vectors.h"

"""
_DUALS = """\
INLINE dual load_dual(real value, __global const scalar *partials, int count) {
    const dual r = {value, load(partials), load(partials + count),
                    load(partials + 2 * count)};
    return r;
}

"""

_KERNEL = """\
__kernel void @_operations(__global const scalar *arguments, __global const scalar *partials,
                           __global scalar *results, int count) {
    const int lane = (int)get_global_id(0) * LANES, index = (int)get_global_id(1);
    const real a = load(arguments + 3 * index * count + lane);
    const real b = load(arguments + (3 * index + 1) * count + lane);
    const real c = load(arguments + (3 * index + 2) * count + lane);
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
        f"    store(results + ({len(outputs)} * index + {place}) * count + lane, {output});"
        for place, output in enumerate(outputs)
    )
    return _KERNEL.replace("@", number_type).replace("$cases", cases).replace("$stores", stores)


class Runner:
    """The program of both number types for one lane count and precision."""

    def __init__(
        self, device: Device, precision: Precision, lanes: int, real: Sequence[str], dual: Sequence[str]
    ) -> None:
        text = _HEAD + LOADS + _DUALS + _kernel("real", real) + _kernel("dual", dual)
        self._kernels = SmallKernels(device, text, precision, lanes)

    def run(self, number_type: str, arguments: Floats, partials: Floats) -> Floats:
        """Results of shape (operations, planes, count): the value, and of duals the three partials.

        `arguments` has the shape (operations, 3, count), `partials` (9, count).
        """
        count = arguments.shape[-1]
        planes = 1 if number_type == "real" else 4
        result = np.empty((len(arguments), planes, count), self._kernels.precision)
        name, given = f"{number_type}_operations", (arguments, partials)
        return self._kernels.run(name, *given, result, np.int32(count), result=result, rows=len(arguments))
