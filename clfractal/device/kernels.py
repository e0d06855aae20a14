"""Kernels of programs that are loaded, ready to be launched, and lent to one user at a time.

Some drivers lose a few KB with each kernel that is made, and pyopencl takes a millisecond to make one ready: what is
drawn again, by the same engine or another, gets the kernels that were used before.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence

import numpy as np
import pyopencl as cl

from clfractal.device.groups import fitting
from clfractal.device.program import Program
from clfractal.device.select import Device


class Kernels:
    """The kernels of some programs.

    Args:
        device: where.
        built: the programs, and the names of their kernels.
        numbers: how many 32-bit whole numbers every kernel is given last; None: that is told at each launch.
    """

    def __init__(
        self, device: Device, built: Sequence[tuple[Program, Sequence[str]]], numbers: int | None
    ) -> None:
        self.device = device
        self._kernels = {name: program.kernel(name) for program, names in built for name in names}
        if numbers is not None:
            for kernel in self._kernels.values():
                # With the types known all are set in the time that one takes without.
                kernel.set_scalar_arg_dtypes([None] * (kernel.num_args - numbers) + [np.int32] * numbers)
        self._groups: dict[tuple[str, tuple[int, ...]], tuple[int, ...]] = {}

    def kernel(self, name: str) -> cl.Kernel:
        """One of them. All of its arguments must be set before each launch: they are those of whoever had it before."""
        return self._kernels[name]

    def group(self, name: str, wanted: tuple[int, ...]) -> tuple[int, ...]:
        """The size of its work-groups: as is wanted, if the device can have them."""
        if (name, wanted) not in self._groups:
            self._groups[name, wanted] = fitting(self.device, self._kernels[name], wanted)
        return self._groups[name, wanted]


class Lease:
    """Kernels that nobody else has as long as this object is kept."""

    def __init__(
        self, device: Device, built: Sequence[tuple[Program, Sequence[str]]], numbers: int | None = None
    ) -> None:
        """Takes kernels that rest, or new ones; arguments and errors as of `Kernels` and `Program.kernel`."""
        programs = tuple(program.cl_program for program, _ in built)
        names = tuple((program.cl_program.int_ptr, *names) for program, names in built)
        key, loaded = (names, numbers), device.loaded
        kernels: Kernels = loaded.take_kernels(key) or Kernels(device, built, numbers)
        self.kernel, self.group = kernels.kernel, kernels.group
        # The programs go along: as long as they are kept, no other one has their place in memory, which the key is made of.
        weakref.finalize(self, loaded.rest_kernels, key, programs, kernels).atexit = False
