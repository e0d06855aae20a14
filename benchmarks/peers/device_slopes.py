"""The derivatives that kernels compute of an application, beside differences with many digits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from typing import Any, Literal

import mpmath
import numpy as np
import numpy.typing as npt
import pyopencl as cl

from benchmarks.peers.slopes import DIGITS, TRIES, Slopes, differences, drawn, names_of, relative
from clfractal.device import compiler, program
from clfractal.device.select import Device
from clfractal.device.source import flatten
from clfractal.formulas.carried import carried_over_duals
from clfractal.formulas.chain import single
from clfractal.formulas.definition import BoundFormula
from clfractal.formulas.opencl import write_formula

AGREED = 1e-6
"""Largest relative difference of partials that agree, in float64: some formulas cancel much."""
FORMS: tuple[Literal["operations"], Literal["jacobian"]] = ("operations", "jacobian")
_HEAD = "".join(
    f'#include "{name}.h"\n'
    for name in (
        "device/lanes",
        "formulas/numbers/real",
        "formulas/numbers/powers",
        "formulas/numbers/quick",
        "device/vectors",
    )
)
_FLAGS = ("-cl-opt-disable",)
"""Compiled once, and run for a few places."""


@dataclass(frozen=True, slots=True)
class _Field:
    """A number that goes with z over dual numbers: its place among all that an application depends on."""

    name: str
    place: int
    dual: bool = True

    @property
    def parts(self) -> list[str]:
        """Its numbers in C."""
        return [f"{self.name}.{part}" for part in ("v", "dx", "dy", "dz")] if self.dual else [self.name]


def slopes_on(
    device: Device, bound: BoundFormula, number: int, chance: Random, places: int, into: Slopes
) -> None:
    """As `slopes_of`, of what a formula's text does with dual numbers, in both forms, along three ways.

    The point's coordinates go along the axes, as kernels take for granted; all else goes anywhere.
    """
    chain = single(bound)
    size = chain.size
    fields = [_Field(f"s{place}", place) for place in range(size)]
    for name, kind in carried_over_duals(chain).items():
        place = chain.carried.index(name)
        fields.append(_Field(f"e{place}", size + place, kind == "dual"))
    texts = [write_formula(chain, dual_map=form) for form in FORMS]
    kernels = [_kernel(device, text.text, fields, size) for text in dict.fromkeys(texts)]
    names = names_of(bound)
    moving = [each.place for each in fields if each.dual]
    with mpmath.workdps(DIGITS):
        for _ in range(places):
            for _ in range(TRIES):
                # What a float64 holds, so that both begin at the same place.
                start = np.array([float(drawn(chance)) for _ in names])
                ways = np.zeros((3, len(names)))
                ways[:, moving] = [[chance.uniform(-1, 1) for _ in moving] for _ in range(3)]
                ways[:, -size:][:, :3] = np.eye(3)
                expected = differences(bound, number, [*map(mpmath.mpf, start)], ways.tolist())
                if not isinstance(expected, bool):
                    break
                into.anew += expected
                into.endless += not expected
            else:
                continue
            into.places += 1
            given = [*(part for each in fields for part in _given(each, start, ways)), *start[-size:]]
            for kernel in kernels:
                found = iter(_run(device, kernel, np.array(given), number, texts[0].constants))
                for each in fields:
                    row = [mpmath.mpf(float(next(found))) for _ in each.parts][1:]
                    worst = max(relative(row, expected[each.place])) if each.dual else 0.0
                    if not worst <= into.largest:
                        into.largest, into.where = worst, f"{names[each.place]} on the device: {row}"


def _given(field: _Field, start: npt.NDArray[np.float64], ways: npt.NDArray[np.float64]) -> list[float]:
    return [start[field.place], *(ways[:, field.place] if field.dual else ())]


def _kernel(device: Device, text: str, fields: Sequence[_Field], size: int) -> cl.Kernel:
    parts = [part for each in fields for part in each.parts]
    lines = [f"z.{part} = given[{number}];" for number, part in enumerate(parts)]
    for place in range(size):
        lines.append(f"c.s{place} = dual_constant(given[{len(parts) + place}]);")
        lines += [f"c.s{place}.d{axis} = R(1.0);" for axis in "xyz"[place : place + 1]]
    lines.append("const dual_state next = dual_apply(n, z, c, k);")
    lines += (f"found[{number}] = next.{part};" for number, part in enumerate(parts))
    head = "__kernel void slopes(__global const scalar *given, __global scalar *found, int n, __constant const scalar *k)"
    body = "".join(f"    {line}\n" for line in ("dual_state z, c;", *lines))
    kernel = f"{head} {{\n{body}}}\n"
    generated = {"slopes.cl": f'{_HEAD}#include "formula.h"\n{kernel}', "formula.h": text}
    flat = flatten("slopes.cl", generated=generated, defines={"LANES": 1, "REAL_IS_DOUBLE": 1})
    built = compiler.compile_source(device, flat.text, [*program.math_flags("float64"), *_FLAGS])
    return cl.Kernel(built, "slopes")


def _run(
    device: Device, kernel: cl.Kernel, given: npt.NDArray[np.float64], number: int, constants: Sequence[float]
) -> npt.NDArray[Any]:
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    found = np.full(len(given), np.nan)
    buffers = [cl.Buffer(device.context, flags, hostbuf=each) for each in (given, np.array(constants, float))]
    answer = cl.Buffer(device.context, cl.mem_flags.WRITE_ONLY, found.nbytes)
    kernel(device.queue, (1,), None, buffers[0], answer, np.int32(number), buffers[1])
    cl.enqueue_copy(device.queue, found, answer)
    return found
