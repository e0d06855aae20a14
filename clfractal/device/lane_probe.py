"""The job that finds out, in a child process, whether a lane count works on a device."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.program import Program, build, math_flags
from clfractal.device.select import Device, by_key, is_simulator
from clfractal.device.source import FlatText, flatten
from clfractal.device.structs import Precision

_WIDTH, _ROWS, _LIMIT = 512, 256, 40
_WIDTH_SIMULATED, _ROWS_SIMULATED = 16, 1
_CHECKED = 4  # of the points every fourth in both directions

# A driver is right if its built-in functions are within some units in the last place of ours and all but a
# few of the chaotic counts agree: fused and separate roundings part near the set's surface.
_TOLERANCE: dict[Precision, float] = {"float32": 3e-6, "float64": 1e-14}
_COUNTS_MAY_DIFFER = 0.01
_MANY_TURNS = 1e7

_HEADERS = '#include "device/repairs.h"\n#include "device/probe.cl"\n'


def lanes_job(request: Mapping[str, Any]) -> dict[str, Any]:
    """Try `request["lanes"]` in `request["precision"]`.

    Returns `fault`, a text that is empty if the results are right.
    """
    device = by_key(*request["device"])
    precision: Precision = request["precision"]
    lanes = int(request["lanes"])
    flat = program_text(lanes, precision)
    flags = math_flags(precision)
    program = build(device, flat.text, flags=flags, sources=flat.sources, isolated=False, keep=False)
    fault = _built_ins_fault(program, precision, lanes) or _mixed_lanes_fault(program, precision, lanes)
    width, rows = (_WIDTH_SIMULATED, _ROWS_SIMULATED) if is_simulator(device.info) else (_WIDTH, _ROWS)
    counts = _launch(program, "escape_counts", precision, rows, width, rows * width // lanes)
    differing = np.mean(counts[::_CHECKED, ::_CHECKED] != _expected_counts(width, rows))
    if differing > _COUNTS_MAY_DIFFER:
        fault = fault or f"{differing:.0%} of the escape counts are wrong"
    inside = _launch(program, "side_by_side", precision, rows, width, rows * width // (2 * lanes))
    differing = np.mean(inside != _expected_inside(width, rows))
    if differing > _COUNTS_MAY_DIFFER:
        fault = fault or f"{differing:.0%} of the points of packets side by side are wrong"
    return {"fault": fault}


def program_text(lanes: int, precision: Precision) -> FlatText:
    """The whole text of the program that tries a lane count."""
    defines = {"LANES": lanes, "REAL_IS_DOUBLE": int(precision == "float64")}
    return flatten("probe_entry.cl", generated={"probe_entry.cl": _HEADERS}, defines=defines)


def _built_ins_fault(program: Program, precision: Precision, lanes: int) -> str:
    t = np.linspace(0.01, 0.99, 64).astype(precision)
    arguments, sums = _buffer(program.device, t), _buffer(program.device, np.zeros_like(t))
    kernel = program.kernel("built_ins")
    kernel.set_args(sums, arguments)
    result = np.empty_like(t)
    with program.device.failures("trying the built-in functions"):
        cl.enqueue_nd_range_kernel(program.device.queue, kernel, (len(t) // lanes,), (1,))
        cl.enqueue_copy(program.device.queue, result, sums)
    expected = _expected_sums(t.astype(np.float64))
    error = float(np.max(np.abs(result - expected) / expected))
    return "" if error <= _TOLERANCE[precision] else f"built-in functions are wrong by {error:.1e}"


def _mixed_lanes_fault(program: Program, precision: Precision, lanes: int) -> str:
    """Arguments that are small, usual, huge, zero or infinite, in any neighbourhood."""
    random = np.random.default_rng(1)
    t = np.exp(random.normal(scale=4.0, size=1024)) * random.choice([-1.0, 1.0], 1024)
    t[random.random(1024) < 0.2] *= 1e8
    t[random.random(1024) < 0.1] = 0.0
    t[random.random(1024) < 0.1] = np.inf
    t = t.astype(precision)
    values = np.empty((4, len(t)), precision)
    arguments, results = _buffer(program.device, t), _buffer(program.device, values)
    kernel = program.kernel("mixed_lanes")
    kernel.set_args(results, arguments, np.int32(len(t)))
    with program.device.failures("trying packets of mixed lanes"):
        cl.enqueue_nd_range_kernel(program.device.queue, kernel, (len(t) // lanes,), (1,))
        cl.enqueue_copy(program.device.queue, values, results)
    with np.errstate(all="ignore"):
        exact = t.astype(np.float64)
        expected = np.stack([np.sin(exact), np.cos(exact), np.abs(exact) ** 1.7, np.log(np.abs(exact))])
        error = np.abs(values - expected) / np.maximum(np.abs(expected), 1.0)
    limits = np.full(t.shape, 4 * _TOLERANCE[precision])
    if precision == "float64":
        # Mesa 25's sin is that of an argument that is off by its last digit, which is what our arguments are too.
        limits += np.spacing(np.abs(np.where(np.isfinite(exact), exact, 0)))
    right = (values == expected) | (error <= limits) | np.isnan(expected)
    if precision == "float64":
        # Turns beyond 1e7 are wrong there. No picture shows which part of such a turn it is; neighbours have to be right.
        right[:2] |= (np.abs(exact) > _MANY_TURNS) & (np.abs(values[:2]) <= 1)
    if right.all():
        return ""
    function = ("sin", "cos", "pow", "log")[int(np.argmin(right.all(axis=1)))]
    return f"{function} is wrong in packets of unlike lanes"


def _launch(
    program: Program, kernel_name: str, precision: Precision, rows: int, width: int, items: int
) -> npt.NDArray[Any]:
    """What a kernel finds for each point of a plane, shape (rows, width)."""
    device = program.device
    found = np.empty((rows, width), precision)
    buffer = _buffer(device, found)
    kernel = program.kernel(kernel_name)
    kernel.set_args(buffer, np.int32(width), np.int32(_LIMIT))
    with device.failures("counting escapes"):
        cl.enqueue_nd_range_kernel(device.queue, kernel, (items,), None)
        cl.enqueue_copy(device.queue, found, buffer)
    return found


def _buffer(device: Device, values: npt.NDArray[Any]) -> cl.Buffer:
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    return cl.Buffer(device.context, flags, hostbuf=values)


def _expected_sums(t: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    total = np.sqrt(t) + np.exp(t) + np.log(t + 0.5) + np.exp2(t) + np.log2(t + 0.5) + np.sin(t) + np.cos(t)
    total += np.tan(t) + np.arcsin(t) + np.arccos(t) + np.arctan(t) + np.arctan2(t, 0.7) + (t + 0.5) ** 1.7
    total += np.floor(t * 8) + np.abs(t - 0.5) + np.minimum(t, 0.4) + np.maximum(t, 0.6)
    total += np.clip(t, 0.3, 0.7) + np.where(t < 0.5, 1, 2) + 4
    return np.asarray(total, np.float64)


def _expected_counts(width: int, rows: int) -> npt.NDArray[np.float64]:
    """The counts of `escape_counts` at the checked points, by the polar form of the rule."""
    scale = 2.5 / width
    columns, checked_rows = np.arange(0, width, _CHECKED), np.arange(0, rows, _CHECKED)
    cx, cy = np.meshgrid(columns * scale - 1.25, checked_rows * scale - 1.25)
    cz = np.full_like(cx, 0.3)
    x, y, z = cx.copy(), cy.copy(), cz.copy()
    count: npt.NDArray[np.float64] = np.zeros_like(cx)
    alive = x * x + y * y + z * z <= 4
    for n in range(_LIMIT):
        px, py, pz = x[alive], y[alive], z[alive]
        rho = np.hypot(px, py)
        polar, azimuth = 8 * np.arctan2(rho, pz), 8 * np.arctan2(py, px)
        radius = np.hypot(rho, pz) ** 8
        x[alive] = radius * np.sin(polar) * np.cos(azimuth) + cx[alive]
        y[alive] = radius * np.sin(polar) * np.sin(azimuth) + cy[alive]
        z[alive] = radius * np.cos(polar) + cz[alive]
        count[alive] = n + 1
        alive &= np.asarray(x * x + y * y + z * z <= 4)
    return count


def _expected_inside(width: int, rows: int) -> npt.NDArray[np.bool_]:
    """What `side_by_side` finds, by complex numbers."""
    scale = 3.0 / width
    c = np.arange(width) * scale - 2.25 + 1j * (np.arange(rows)[:, None] * scale - 1.25)
    z = c.copy()
    inside: npt.NDArray[np.bool_] = np.abs(z) <= 2
    for _ in range(_LIMIT):
        z[inside] = z[inside] ** 2 + c[inside]
        inside &= np.abs(z) <= 2
    return inside
