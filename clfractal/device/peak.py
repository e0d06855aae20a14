"""The device's measured peak of fused multiply-adds, the yardstick of `clfractal bench`."""

from __future__ import annotations

import numpy as np
import pyopencl as cl

from clfractal.device.program import Program, build, math_flags
from clfractal.device.select import Device, has_float64, is_simulator
from clfractal.device.structs import Precision
from clfractal.errors import STATUS_BAD_INPUT, DeviceError

_CHAINS = (4, 8, 12)  # enough independent ones hide the latency of an FMA (4 cycles, two units: 8)
_WIDTHS = (1, 8, 16)
_STEPS, _STEPS_SIMULATED = 2000, 4
_LAUNCHES = 4
_NAMES = {f"w{width}c{chains}": (width, chains) for width in _WIDTHS for chains in _CHAINS}

# The multiplier is below 1 and unknown to the compiler, so that no chain overflows, fades out or folds away.
_KERNEL = """
__kernel void chains(__global {real} *out, {real} factor, {real} summand) {{
    const {vector} a = ({vector})(factor), b = ({vector})(summand);
    {vector} {declarations};
    for (int step = 0; step < {steps}; ++step) {{
        {body}
    }}
    const {vector} total = {total};
    out[get_global_id(0)] = {sum};
}}
"""


def fma_peak(device: Device, precision: Precision) -> float:
    """The device's fastest measured rate in GFLOP/s, a fused multiply-add counting as two operations.

    Tries several vector widths and numbers of independent chains, as no single shape suits every device;
    takes about a second.

    Raises:
        DeviceError: status 2, the device has no float64; status 3, it failed.
    """
    if precision == "float64" and not has_float64(device.info):
        raise DeviceError(f"{device.info.name} has no float64", status=STATUS_BAD_INPUT)
    steps = _STEPS_SIMULATED if is_simulator(device.info) else _STEPS
    program = build(device, program_text(precision, steps), flags=math_flags(precision))
    return max(
        _rate(program, precision, name, width * chains * steps) for name, (width, chains) in _NAMES.items()
    )


def program_text(precision: Precision, steps: int = _STEPS) -> str:
    """A kernel for each width and number of chains."""
    texts = [
        _text(precision, width, chains, steps).replace("void chains", f"void {name}")
        for name, (width, chains) in _NAMES.items()
    ]
    enable = "#pragma OPENCL EXTENSION cl_khr_fp64 : enable\n" if precision == "float64" else ""
    return enable + "\n".join(texts)


def _text(precision: Precision, width: int, chains: int, steps: int) -> str:
    real = "double" if precision == "float64" else "float"
    vector = real if width == 1 else f"{real}{width}"
    names = [f"x{index}" for index in range(chains)]
    lanes = [f"total.s{lane:x}" for lane in range(width)] if width > 1 else ["total"]
    return _KERNEL.format(
        real=real,
        vector=vector,
        steps=steps,
        declarations=", ".join(
            f"{name} = a + ({real})({index} + get_global_id(0))" for index, name in enumerate(names)
        ),
        # Compilers fuse this; `fma` would be a call of the library where a driver cannot inline it.
        body=" ".join(f"{name} = {name} * a + b;" for name in names),
        total=" + ".join(names),
        sum=" + ".join(lanes),
    )


def _rate(program: Program, precision: Precision, name: str, fmas_per_item: int) -> float:
    device = program.device
    # Enough work-items to fill a GPU and to outlast the cost of a launch on a CPU.
    local = 64 if device.info.kind == "gpu" else 1
    items = device.info.compute_units * (2048 if device.info.kind == "gpu" else 64)
    if is_simulator(device.info):
        items = 1
    dtype = np.dtype(precision)
    out = device.buffer(items * dtype.itemsize, "the measurement of the peak")
    kernel = program.kernel(name)
    kernel.set_args(out, dtype.type(0.999), dtype.type(0.001))
    fastest = float("inf")
    with device.failures("measuring the peak"):
        for _ in range(_LAUNCHES):
            event = cl.enqueue_nd_range_kernel(device.queue, kernel, (items,), (local,))
            event.wait()
            fastest = min(fastest, event.profile.end - event.profile.start)
    return 2.0 * fmas_per_item * items / max(fastest, 1.0)
