"""Formulas at lists of points, on a device: escape counts, distances and normals."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device import program
from clfractal.device.cancel import CancelToken
from clfractal.device.kernels import Lease
from clfractal.device.launch import Pace, Part, in_launches, wait_for_copy
from clfractal.device.select import Device
from clfractal.device.source import FlatText, flatten
from clfractal.device.structs import Precision
from clfractal.device.watched import Watched
from clfractal.formulas.language import Chain
from clfractal.geometry.solids import Body
from clfractal.integrators.declarations import struct_text

Floats = npt.NDArray[np.float64]

# Most points of one launch: bounds the device memory.
LAUNCH_POINTS = 1 << 18

# Points of a work-group. Fixed, because PoCL compiles a kernel anew for every size of work-group.
GROUP_POINTS = 64


@dataclass(frozen=True, slots=True, eq=False)
class Distances:
    """What is known of points, arrays of shape (n,), normals of shape (n, 3).

    Attributes:
        step: the distance that rays march by, scene units; 0 inside.
        full: the distance by the full Jacobian (the same for formulas without a scalar rule).
        normal: unit gradient of the distance; zero where there is none, as inside.
        smooth: smooth escape count.
        inside: never escaped.
    """

    step: Floats
    full: Floats
    normal: Floats
    smooth: Floats
    inside: npt.NDArray[np.bool_]


def escape(
    chain: Chain,
    points: npt.ArrayLike,
    iterations: int,
    *,
    device: Device,
    lanes: int,
    precision: Precision = "float32",
    bailout: float | None = None,
    token: CancelToken | None = None,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """Escape counts of points, shape (n, 3) in scene units: (iterations, inside), both of shape (n,).

    `iterations` counts applications until |z| exceeds the bailout; a point that never gets there has the limit and is
    inside. Counts are exact up to MOST_APPLICATIONS, the largest limit, in both number types.

    Raises:
        ValueError: points of another shape, or not finite.
        DeviceError, KernelBuildError: the device failed.
        Stopped: the token was set.
    """
    array = _checked(points)
    result = np.empty((2, len(array)), np.int32)
    body = Body(chain, iterations, bailout=bailout)
    _run(body, array, "escape_counts", result, device, lanes, precision, token)
    return result[0].astype(np.int64), result[1] > 0


def distances(
    chain: Chain,
    points: npt.ArrayLike,
    iterations: int,
    *,
    device: Device,
    lanes: int,
    precision: Precision = "float32",
    token: CancelToken | None = None,
) -> Distances:
    """Distances to a formula's set at points of shape (n, 3), with normals; see `escape` for the errors."""
    body = Body(chain, iterations)
    return nearest(body, points, device=device, lanes=lanes, precision=precision, token=token)[0]


def nearest(
    body: Body,
    points: npt.ArrayLike,
    *,
    device: Device,
    lanes: int,
    precision: Precision = "float32",
    token: CancelToken | None = None,
) -> tuple[Distances, npt.NDArray[np.int64]]:
    """As `distances`, of a scene's body too, and whose surface is nearest.

    Returns:
        What is known of the points, and numbers of objects, from 1; 0 is the scene's own formula.
    """
    array = _checked(points)
    planes = 7 if body.scene is None else 8
    result = np.empty((planes, len(array)), precision)
    _run(body, array, "distances", result, device, lanes, precision, token)
    inside = result[6] > 0
    # Inside the kernel's gradient is that of |z| after the last application; the distance is 0 all around.
    normal = np.where(inside[:, None], 0.0, result[2:5].T)
    step, full, smooth = (result[plane].astype(np.float64) for plane in (0, 1, 5))
    found = Distances(step, full, normal.astype(np.float64), smooth, inside)
    return found, (result[7] if body.scene is not None else np.zeros(len(array))).astype(np.int64)


def program_text(body: Body, lanes: int, precision: Precision) -> FlatText:
    """The whole text of the program for a body's points."""
    generated = {**body.texts(), "structs.h": struct_text()}
    defines = {"LANES": lanes, "REAL_IS_DOUBLE": int(precision == "float64")}
    return flatten("formulas/points.cl", generated=generated, defines=defines, user=["formula.h"])


def _checked(points: npt.ArrayLike) -> Floats:
    array = np.asarray(points, np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"points must have shape (n, 3), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError("points must be finite")
    return array


def _run(
    body: Body,
    array: Floats,
    kernel_name: str,
    result: npt.NDArray[Any],
    device: Device,
    lanes: int,
    precision: Precision,
    token: CancelToken | None,
) -> None:
    """Runs one of the kernels of `points.cl`; its planes go into `result`, shape (planes, n)."""
    text = program_text(body, lanes, precision)
    built = program.build(device, text.text, flags=program.math_flags(precision), sources=text.sources)
    lease = Lease(device, [(built, (kernel_name,))])
    kernel = lease.kernel(kernel_name)
    orbit = Watched(device, body.records(precision))
    constants, sent = _upload(device, body.constants(precision))
    planes, place = len(result), 0
    # Farther away numbers of this type have no squares, and what is as far as that escapes at once.
    farthest = float(np.sqrt(np.finfo(precision).max)) / 4

    def enqueue(size: float) -> Part[_Launch] | None:
        nonlocal place
        if place >= len(array):
            return None
        part = array[place : place + int(min(size, LAUNCH_POINTS))]
        count = -(-len(part) // GROUP_POINTS) * GROUP_POINTS
        padded = np.zeros((3, count), precision)
        padded[:, : len(part)] = np.clip(part, -farthest, farthest).T
        with device.failures("evaluating points"):
            buffer = device.buffer(planes * count * result.itemsize, "results")
            # A kernel keeps no reference to its arguments: they must outlive the launch.
            given, coming = _upload(device, padded)
            arguments: list[Any] = [given, buffer, np.int32(count), orbit.buffer, constants]
            kernel.set_args(*arguments)
            event = cl.enqueue_nd_range_kernel(
                device.queue, kernel, (count // lanes,), (GROUP_POINTS // lanes,)
            )
            device.queue.flush()
        place += len(part)
        return Part(
            event, float(len(part)), _Launch(place - len(part), len(part), count, arguments, (sent, coming))
        )

    # What a point takes is not known yet: a group of points for each core, of any number of applications.
    pace = Pace(float(GROUP_POINTS * max(device.info.compute_units, 1)), least=float(GROUP_POINTS))
    launches = in_launches(device, enqueue, pace, doing="evaluating points", token=token, watched=[orbit])
    with closing(launches):
        for launch, _ in launches:
            out = np.empty((planes, launch.padded), result.dtype)
            with device.failures("evaluating points"):
                copied = cl.enqueue_copy(device.transfers, out, launch.arguments[1], is_blocking=False)
                device.transfers.flush()
            wait_for_copy(copied, device, "evaluating points", token)
            result[:, launch.first : launch.first + launch.count] = out[:, : launch.count]


@dataclass(frozen=True, slots=True)
class _Launch:
    """Points of a launch: the first, how many, how many with those that fill up the last group; arguments, their copies."""

    first: int
    count: int
    padded: int
    arguments: list[Any]
    sent: tuple[cl.Event, ...]


def _upload(device: Device, array: npt.NDArray[np.generic]) -> tuple[cl.Buffer, cl.Event]:
    buffer = device.buffer(array.nbytes, "points", read_only=True)
    # Not waited for: the queue is in order, and the launch that is under way may take long. The event keeps the array.
    data = np.ascontiguousarray(array).view(np.uint8).reshape(-1)
    return buffer, cl.enqueue_copy(device.queue, buffer, data, is_blocking=False)
