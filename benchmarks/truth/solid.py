"""The set itself: which points are inside, in float64, by the formula alone."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device import program
from clfractal.device.select import Device, has_float64
from clfractal.device.source import flatten
from clfractal.device.watched import Watched
from clfractal.errors import DeviceError
from clfractal.formulas.language import Chain
from clfractal.formulas.opencl import write_formula
from clfractal.integrators import records
from clfractal.integrators.declarations import struct_text
from clfractal.integrators.lanes import best_lanes, rule_of
from clfractal.integrators.points import Distances, distances

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

_LAUNCH = 1 << 18
_GROUP = 64


class Inside(Protocol):
    """Whatever can say which points are inside."""

    def inside(self, points: Floats) -> Mask:
        """Which of the points are inside: shape (..., 3) in scene units gives shape (...)."""


class Estimated(Inside, Protocol):
    """It also has an idea of how far away it is."""

    def distances(self, points: Floats) -> Distances:
        """Estimates at points of shape (n, 3): `full` and `normal` count."""


class Solid:
    """The points that stay within the bailout for all iterations, or are inside the last `shape`.

    Raises:
        DeviceError, KernelBuildError: the device failed, or has no float64.
    """

    def __init__(self, chain: Chain, iterations: int, device: Device) -> None:
        if not has_float64(device.info):
            raise DeviceError(f"{device.info.name} has no float64, which what is inside is decided in")
        self.chain, self.iterations, self.device = chain, iterations, device
        self.lanes = best_lanes(device, "float64", rule_of(chain))
        formula = write_formula(chain)
        generated = {
            "inside.cl": Path(__file__).with_name("inside.cl").read_text(encoding="utf-8"),
            "formula.h": formula.text,
            "structs.h": struct_text(),
        }
        defines = {"LANES": self.lanes, "REAL_IS_DOUBLE": 1}
        text = flatten("inside.cl", generated=generated, defines=defines, user=["formula.h"])
        built = program.build(device, text.text, flags=program.math_flags("float64"), sources=text.sources)
        self._kernel = built.kernel("inside")
        self._orbit = Watched(device, records.orbit_record(chain, iterations, "float64").reshape(1))
        self._constants = _filled(device, np.array([*formula.constants, 0.0], np.float64))
        self._points = device.buffer(24 * _LAUNCH, "points", read_only=True)
        self._found = device.buffer(_LAUNCH, "results")

    def inside(self, points: Floats) -> Mask:
        """Which of the points are inside: shape (..., 3) in scene units gives shape (...)."""
        flat = points.reshape(-1, 3)
        result = np.empty(len(flat), np.int8)
        for first in range(0, len(flat), _LAUNCH):
            part = flat[first : first + _LAUNCH]
            count = -(-len(part) // _GROUP) * _GROUP
            padded = np.zeros((3, count))
            padded[:, : len(part)] = part.T
            found = np.empty(count, np.int8)
            queue = self.device.queue
            with self.device.failures("finding inside points"):
                cl.enqueue_copy(queue, self._points, padded)
                self._kernel(
                    queue,
                    (count // self.lanes,),
                    (_GROUP // self.lanes,),
                    self._points,
                    self._found,
                    np.int32(count),
                    self._orbit.buffer,
                    self._constants,
                )
                cl.enqueue_copy(queue, found, self._found)
            result[first : first + len(part)] = found[: len(part)]
        inside: Mask = result.reshape(points.shape[:-1]) > 0
        return inside

    def distances(self, points: Floats) -> Distances:
        """The program's own estimates at points of shape (n, 3), in float64."""
        return distances(
            self.chain, points, self.iterations, device=self.device, lanes=self.lanes, precision="float64"
        )


def _filled(device: Device, array: Floats) -> cl.Buffer:
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    with device.failures("uploading constants"):
        return cl.Buffer(device.context, flags, hostbuf=array)
