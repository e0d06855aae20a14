"""Finds the fastest lane count of a device: measured once for each device and driver, with the march used for rendering.

Small pictures are marched with each lane count that works (`device/tune.py`): the Mandelbulb by its scalar rule, and hast
by its Jacobian, since what fits one into the processor's registers need not fit the other.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
import pyopencl as cl

from clfractal.device import activity, cache, isolate, program, select, tune
from clfractal.device.groups import fitting
from clfractal.device.select import Device
from clfractal.device.source import FlatText, flatten
from clfractal.device.structs import Precision
from clfractal.errors import STATUS_BAD_INPUT, ClfractalError, DeviceError
from clfractal.formulas.catalog import load_chain
from clfractal.formulas.language import Chain
from clfractal.formulas.opencl import FormulaText, write_formula
from clfractal.renderers.records import MARCH, NEAR, SHADOW_DETAIL, SHADOW_LIFT, orbit_record, struct_text
from clfractal.scene.surface import SurfaceRenderer

LANES_VARIABLE = "CLFRACTAL_LANES"
JOB = "clfractal.renderers.lanes:march_job"

Rule = Literal["scalar", "jacobian"]
RULES: tuple[Rule, ...] = ("scalar", "jacobian")

_VERSION = 1  # of this measurement: older ones no longer count
_SECTION = "marches"
_TIMEOUT_S = 60.0
# The pictures' sides: enough work-items for a GPU; on a processor launches of a millisecond, many of which no other program
# interrupts.
_SIDES: dict[Rule, int] = {"scalar": 128, "jacobian": 64}
_SIDE_GPU = 1024
_LAUNCHES, _SECONDS = 200, 0.5
_GROUP, _GROUP_GPU = (8, 1), (8, 8)


@dataclass(frozen=True, slots=True)
class _Example:
    """What is marched: formula, iterations, the eye, where it looks, and the direction to the light."""

    formula: str
    parameters: Mapping[str, float]
    iterations: int
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    light: tuple[float, float, float]


# Views of the speed table (`clfractal bench`).
_EXAMPLES: dict[Rule, _Example] = {
    "scalar": _Example("mandelbulb", {"power": 8}, 100, (0, -3, 0), (0, 0, 0), (-0.5, -0.6, 0.62)),
    "jacobian": _Example("hast", {"power": 2}, 40, (-0.8, 2.2, 3.0), (-0.5, 0, 0), (0.4, 0.5, 0.77)),
}


@dataclass(frozen=True, slots=True)
class MarchReport:
    """How long one lane count takes for a pixel by each rule, nanoseconds; `fault` is empty if it may be used."""

    lanes: int
    scalar: float
    jacobian: float
    fault: str

    def nanoseconds(self, rule: Rule) -> float:
        """Of a pixel marched by that rule."""
        return self.scalar if rule == "scalar" else self.jacobian


# By cache folder, device and number type.
_reports: dict[tuple[str, str, str], tuple[MarchReport, ...]] = {}


def rule_of(chain: Chain) -> Rule:
    """The rule for a formula's distances while marching: its scalar rule, if every member has one, else the Jacobian."""
    return "scalar" if write_formula(chain).has_derivative else "jacobian"


def best_lanes(
    device: Device,
    precision: Precision,
    rule: Rule = "scalar",
    *,
    on_start: Callable[[str], None] | None = None,
) -> int:
    """The lane count that marches fastest by a rule, or the value of the environment variable CLFRACTAL_LANES.

    Args:
        device: the device.
        precision: the number type of the rays.
        rule: see `rule_of`.
        on_start: told, once, that a measurement of some seconds begins.

    Raises:
        DeviceError: status 2 for a variable that is no lane count, or a device without float64; status 3 if no lane count
            works.
    """
    override = os.environ.get(LANES_VARIABLE, "").strip()
    if override:
        if override not in map(str, tune.LANE_COUNTS):
            known = ", ".join(map(str, tune.LANE_COUNTS))
            raise DeviceError(
                f"{LANES_VARIABLE} must be one of {known}, got {override!r}", status=STATUS_BAD_INPUT
            )
        return int(override)
    reports = march_reports(device, precision, on_start=on_start)
    return min(reports, key=lambda report: report.nanoseconds(rule)).lanes


def march_reports(
    device: Device, precision: Precision, *, on_start: Callable[[str], None] | None = None
) -> tuple[MarchReport, ...]:
    """How fast each promising lane count that works marches, at least one; measured if this device and driver were not
    before. The speed of the best, in float32, is what devices are ranked by.

    Raises:
        DeviceError: as `best_lanes`.
    """
    # Every picture asks, and reading files takes longer than many a frame.
    key = (str(cache.folder()), device.info.key, precision)
    if key not in _reports:
        _reports[key] = _measured_reports(device, precision, _once(on_start))
    return _reports[key]


def _measured_reports(
    device: Device, precision: Precision, tell: Callable[[str], None]
) -> tuple[MarchReport, ...]:
    faults: list[str] = []
    for lane_counts in tune.promising(device):
        reports = []
        for check in tune.lane_reports(device, precision, lane_counts, on_start=tell):
            report = _measured(device, precision, check.lanes, tell) if check.accepted else None
            if report is not None and not report.fault:
                reports.append(report)
            else:
                faults.append(f"{check.lanes} lanes: {report.fault if report is not None else check.fault}")
        if reports:
            if precision == "float32":
                cache.remember(select.SPEEDS, device.info.key, pixels_per_second(reports))
            return tuple(reports)
    raise DeviceError(
        f"{device.info.name}: no kernel works on this device: {faults[0]}", details="\n".join(faults)
    )


def pixels_per_second(reports: Sequence[MarchReport]) -> float:
    """Of both rules, half the pixels by each, with its best lanes."""
    nanoseconds = sum(min(report.nanoseconds(rule) for report in reports) for rule in RULES)
    return 2e9 / nanoseconds


def _once(listener: Callable[[str], None] | None) -> Callable[[str], None]:
    """Tells a listener the first line only."""
    told: list[str] = []

    def tell(line: str) -> None:
        if listener is not None and not told:
            told.append(line)
            listener(line)

    return tell


def _measured(
    device: Device, precision: Precision, lanes: int, on_start: Callable[[str], None]
) -> MarchReport:
    key = " | ".join((device.info.key, precision, str(lanes), JOB, str(_VERSION)))
    try:
        return MarchReport(**cache.recall(_SECTION)[key])
    except (KeyError, TypeError):  # not measured yet, or by another version
        pass
    on_start(f"measuring {device.info.name}, once")
    try:
        request = {"lanes": lanes, "precision": precision}
        with activity.doing(f"measuring {device.info.name}"):
            answer = isolate.run(
                JOB, device, request, doing=f"marching with {lanes} lanes", timeout_s=_TIMEOUT_S
            )
        report = MarchReport(lanes=lanes, fault="", **answer)
    except ClfractalError as error:
        report = MarchReport(lanes, 0.0, 0.0, error.message)
    cache.remember(_SECTION, key, asdict(report))
    return report


def march_job(request: Mapping[str, Any]) -> dict[str, Any]:
    """In a child process: marches the pictures with `request["lanes"]` in `request["precision"]`.

    Returns `scalar` and `jacobian`: nanoseconds a pixel, in the shortest of some launches.
    """
    device = select.by_key(*request["device"])
    lanes, precision = int(request["lanes"]), request["precision"]
    if select.is_simulator(device.info):
        # It would take minutes, and only tells that wide packets are fewer instructions.
        return dict.fromkeys(RULES, 1000000000.0 / lanes)
    sides = dict.fromkeys(RULES, _SIDE_GPU) if device.info.kind == "gpu" else _SIDES
    return {
        rule: 1e6 * march(device, precision, lanes, rule, sides[rule])[0] / sides[rule] ** 2 for rule in RULES
    }


def program_text(formula: FormulaText, lanes: int, precision: Precision) -> FlatText:
    """The whole text of the program that marches for a measurement."""
    defines = {
        "LANES": lanes,
        "REAL_IS_DOUBLE": int(precision == "float64"),
        "SEARCH_DISTANCE": 0,
        "SEARCH_STEPS": 1,
        "SEARCH": 0,
        "POINTS": 1,
        "POLISH": 0,
        "HAS_LENS": 0,
    }
    generated = {"structs.h": struct_text(), "formula.h": formula.text}
    return flatten("march_probe.cl", generated=generated, defines=defines)


def march(
    device: Device, precision: Precision, lanes: int, rule: Rule, side: int
) -> tuple[float, np.ndarray[Any, np.dtype[np.float32]]]:
    """Marches a picture of `side` x `side` pixels.

    Returns:
        Milliseconds of the fastest launch, and for each pixel, shape (side, side, 2), how far its ray went (-1 where it met
        nothing) and whether the light is hidden there.

    Raises:
        DeviceError, KernelBuildError: the device failed.
    """
    example = _EXAMPLES[rule]
    chain = load_chain(example.formula, example.parameters)
    formula = write_formula(chain)
    flat = program_text(formula, lanes, precision)
    flags = program.math_flags(precision)
    built = program.build(device, flat.text, flags=flags, sources=flat.sources, isolated=False)
    met = np.empty((side, side, 2), np.float32)
    arguments: list[Any] = [
        device.buffer(met.nbytes, "the measured picture"),
        *(
            _upload(device, array)
            for array in (
                _settings(chain, precision).reshape(1),
                orbit_record(chain, example.iterations, precision).reshape(1),
                np.array(formula.constants or [0.0], precision),
                _view(example, side).astype(precision),
            )
        ),
        np.int32(side),
    ]
    kernel = built.kernel("march_probe")
    kernel.set_args(*arguments)
    across, down = (1, 1) if lanes == 1 else (4, lanes // 4)
    group = fitting(device, kernel, _GROUP_GPU if device.info.kind == "gpu" else _GROUP)
    times: list[float] = []
    with device.failures("marching"):
        # The first launch makes PoCL compile.
        for _ in range(1 + _LAUNCHES):
            event = cl.enqueue_nd_range_kernel(device.queue, kernel, (side // across, side // down), group)
            event.wait()
            times.append(1e-6 * (event.profile.end - event.profile.start))
            if len(times) > 2 and sum(times[1:]) > 1e3 * _SECONDS:
                break
        cl.enqueue_copy(device.queue, met, arguments[0])
    return max(min(times[1:]), 1e-3), met


def _settings(chain: Chain, precision: Precision) -> np.ndarray[Any, np.dtype[np.void]]:
    """The march of a usual scene; what it does not read stays 0."""
    usual = SurfaceRenderer.model_validate({})
    values: dict[str, object] = {
        "bounds_center": chain.center,
        "bounds_radius": chain.radius,
        "step_scale": chain.step_scale,
        "relaxation": usual.over_relaxation,
        "detail": usual.detail,
        "near": NEAR * chain.step_scale,
        "max_steps": usual.max_steps,
        "shadow_lift": SHADOW_LIFT * usual.detail,
        "shadow_detail": SHADOW_DETAIL,
    }
    unused = {field.name: np.zeros(field.count) if field.count else 0 for field in MARCH.fields}
    return MARCH.value(precision, {**unused, **values})


def _view(example: _Example, side: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The eye, the axis, one pixel to the right, and the direction to the light; the field of view is 53 degrees."""
    eye, light = np.array(example.eye, float), np.array(example.light, float)
    axis = np.array(example.target) - eye
    axis /= np.linalg.norm(axis)
    right = np.cross(axis, [0.0, 0.0, 1.0])
    right *= 1.0 / (side * np.linalg.norm(right))
    return np.concatenate([eye, axis, right, light / np.linalg.norm(light)])


def _upload(device: Device, array: np.ndarray[Any, Any]) -> cl.Buffer:
    buffer = device.buffer(array.nbytes, "the measured scene", read_only=True)
    cl.enqueue_copy(device.queue, buffer, np.ascontiguousarray(array).view(np.uint8).reshape(-1))
    return buffer
