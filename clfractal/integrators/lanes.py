"""Finds the fastest lane count of a device, measured once with the march that renders.

Small pictures are marched with each lane count that works (`device/tune.py`): the Mandelbulb by its scalar rule, and hast
by its Jacobian, since what fits one into the processor's registers need not fit the other. Before that a first picture
takes the count that fits the device's registers, once a trial has shown that it computes rightly: it does not wait for the
measurement. A process keeps the count that it began with, because the last bits of a picture depend on it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from clfractal.device import cache, select, tune
from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.errors import STATUS_BAD_INPUT, DeviceError
from clfractal.formulas.language import Chain
from clfractal.formulas.opencl import write_formula
from clfractal.integrators.trial import RULES, Rule, march, picture_side

LANES_VARIABLE = "CLFRACTAL_LANES"
JOB = "clfractal.integrators.lanes:march_job"

_VERSION = 4  # of this measurement and of the marches that it measures: older ones no longer count
_SECTION = "marches"
_TIMEOUT_S = 60.0
# What a picture has beside the trial gains from wide packets: they are chosen up to so many times the best time.
_NEARLY = 1.1


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
# What this process uses, by the same and the rule.
_in_use: dict[tuple[str, str, str, Rule], int] = {}


def rule_of(chain: Chain) -> Rule:
    """The rule for a formula's distances while marching: its scalar rule, if every member has one, else the Jacobian."""
    return "scalar" if write_formula(chain).has_derivative else "jacobian"


def best_lanes(
    device: Device,
    precision: Precision,
    rule: Rule = "scalar",
    *,
    measures: bool = True,
    on_start: Callable[[str], None] | None = None,
) -> int:
    """The lane count that marches fastest by a rule, or the value of the environment variable CLFRACTAL_LANES.

    Every call in a process gives the same.

    Args:
        device: the device.
        precision: the number type of the rays.
        rule: see `rule_of`.
        measures: whether a device that is not known yet is measured first; else its count is a guess, which was tried.
        on_start: told, once, that a measurement or a trial begins.

    Raises:
        DeviceError: status 2 for a variable that is no lane count, or a device without float64; status 3 if no lane count
            works.
        FileError: there is no room for what the driver writes.
    """
    override = os.environ.get(LANES_VARIABLE, "").strip()
    if override:
        if override not in map(str, tune.LANE_COUNTS):
            known = ", ".join(map(str, tune.LANE_COUNTS))
            raise DeviceError(
                f"{LANES_VARIABLE} must be one of {known}, got {override!r}", status=STATUS_BAD_INPUT
            )
        return int(override)
    # Every picture asks, and reading files takes longer than many a frame.
    key = (*_key(device, precision), rule)
    if key not in _in_use:
        if measures or is_measured(device, precision):
            reports = march_reports(device, precision, on_start=on_start)
            best = min(report.nanoseconds(rule) for report in reports)
            lanes = max(report.lanes for report in reports if report.nanoseconds(rule) <= _NEARLY * best)
        else:
            lanes = tune.first_lanes(device, precision, on_start=on_start)
        _in_use[key] = lanes
    return _in_use[key]


def is_measured(device: Device, precision: Precision) -> bool:
    """Whether the fastest lane count is known, or given by the environment variable."""
    if os.environ.get(LANES_VARIABLE, "").strip():
        return True
    if _key(device, precision) in _reports:
        return True
    tried, marched = cache.recall(tune.SECTION), cache.recall(_SECTION)
    for lane_counts in tune.promising(device):
        works = False
        for lanes in lane_counts:
            check = tune.remembered(tried, device, precision, lanes)
            if check is None:
                return False
            if check.accepted:
                report = tune.recalled(MarchReport, marched.get(_name(device, precision, lanes)))
                if report is None:
                    return False
                works = works or not report.fault
        if works:
            return True
    return False


def march_reports(
    device: Device,
    precision: Precision,
    *,
    on_start: Callable[[str], None] | None = None,
    stopped: Callable[[], bool] | None = None,
) -> tuple[MarchReport, ...]:
    """How fast each promising lane count that works marches, at least one; measured if this device and driver were not
    before. The speed of the best, in float32, is what devices are ranked by.

    Raises:
        DeviceError: as `best_lanes`.
        Stopped: `stopped` answered True; what was measured until then is remembered.
    """
    key = _key(device, precision)
    if key not in _reports:
        _reports[key] = _measured_reports(device, precision, _once(on_start), stopped)
    return _reports[key]


def _measured_reports(
    device: Device, precision: Precision, tell: Callable[[str], None], stopped: Callable[[], bool] | None
) -> tuple[MarchReport, ...]:
    faults: list[str] = []
    for lane_counts in tune.promising(device):
        reports = []
        for check in tune.lane_reports(device, precision, lane_counts, on_start=tell, stopped=stopped):
            report = _measured(device, precision, check.lanes, tell, stopped) if check.accepted else None
            if report is not None and not report.fault:
                reports.append(report)
            else:
                faults.append(f"{check.lanes} lanes: {report.fault if report is not None else check.fault}")
        if reports:
            if precision == "float32":
                cache.remember(select.SPEEDS, device.info.key, pixels_per_second(reports))
            return tuple(reports)
    raise tune.none_works(device, faults)


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
    device: Device,
    precision: Precision,
    lanes: int,
    on_start: Callable[[str], None],
    stopped: Callable[[], bool] | None,
) -> MarchReport:
    key = _name(device, precision, lanes)
    known = tune.recalled(MarchReport, cache.recall(_SECTION).get(key))
    if known is not None:
        return known
    on_start(f"measuring {device.info.name}, once")
    doing = f"marching with {lanes} lanes"
    answer, is_known = tune.tried(
        JOB, device, precision, lanes, doing=doing, timeout_s=_TIMEOUT_S, stopped=stopped
    )
    found: dict[str, Any] = {"scalar": 0.0, "jacobian": 0.0, "fault": "", **answer}
    report = MarchReport(lanes, **found)
    if is_known:
        cache.remember(_SECTION, key, asdict(report))
    return report


def _key(device: Device, precision: Precision) -> tuple[str, str, str]:
    return str(cache.folder()), device.info.key, precision


def _name(device: Device, precision: Precision, lanes: int) -> str:
    """What a measurement is remembered under."""
    return tune.name_of(device, precision, lanes, JOB, _VERSION)


def march_job(request: Mapping[str, Any]) -> dict[str, Any]:
    """In a child process: marches the pictures with `request["lanes"]` in `request["precision"]`.

    Returns `scalar` and `jacobian`: nanoseconds a pixel, in the shortest of some launches.
    """
    device = select.by_key(*request["device"])
    lanes, precision = int(request["lanes"]), request["precision"]
    if select.is_simulator(device.info):
        # It would take minutes, and only tells that wide packets are fewer instructions.
        return dict.fromkeys(RULES, 1000000000.0 / lanes)
    sides = {rule: picture_side(device, rule) for rule in RULES}
    return {
        rule: 1e6 * march(device, precision, lanes, rule, sides[rule])[0] / sides[rule] ** 2 for rule in RULES
    }
