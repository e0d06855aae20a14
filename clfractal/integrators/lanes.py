"""Finds the fastest lane count of a device, measured once with the march that renders.

Small pictures are marched with each lane count that works (`device/tune.py`), in turns (`rounds.py`): the Mandelbulb by its
scalar rule, and hast by its Jacobian, since what fits one into the processor's registers need not fit the other. Before
that a first picture takes the count that fits the device's registers, once a trial has shown that it computes rightly: it
does not wait for the measurement. A process keeps the count that it began with, because the last bits of a picture depend
on it.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from clfractal.device import cache, select, tune
from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.errors import STATUS_BAD_INPUT, DeviceError
from clfractal.formulas.language import Chain
from clfractal.formulas.opencl import write_formula
from clfractal.integrators.rounds import compared, widest
from clfractal.integrators.trial import RULES, Marcher, Rule, picture_side

LANES_VARIABLE = "CLFRACTAL_LANES"
JOB = "clfractal.integrators.lanes:march_job"

_VERSION = 5  # of this measurement and of the marches that it measures: older ones no longer count
_SECTION = "marches"
_TIMEOUT_S = 60.0  # for each lane count


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
            lanes = widest({report.lanes: report.nanoseconds(rule) for report in reports})
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
    before. The speed of the best, in float32, is what devices are ranked by. Where a device was too busy to tell, this
    process keeps what it has found, and the next one measures again.

    Raises:
        DeviceError: as `best_lanes`.
        Stopped: `stopped` answered True; which lane counts work is remembered as far as it was found out.
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
        checks = tune.lane_reports(device, precision, lane_counts, on_start=tell, stopped=stopped)
        faults += [f"{check.lanes} lanes: {check.fault}" for check in checks if not check.accepted]
        working = [check.lanes for check in checks if check.accepted]
        found, is_steady = _marched(device, precision, working, tell, stopped)
        faults += [f"{report.lanes} lanes: {report.fault}" for report in found if report.fault]
        reports = tuple(report for report in found if not report.fault)
        if reports:
            if precision == "float32" and is_steady:
                cache.remember(select.SPEEDS, device.info.key, pixels_per_second(reports))
            return reports
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


def _marched(
    device: Device,
    precision: Precision,
    lane_counts: Sequence[int],
    tell: Callable[[str], None],
    stopped: Callable[[], bool] | None,
) -> tuple[list[MarchReport], bool]:
    """Of each lane count, and whether they may be relied on; remembered, or measured together and then remembered."""
    known = cache.recall(_SECTION)
    recalled = {
        lanes: tune.recalled(MarchReport, known.get(_name(device, precision, lanes))) for lanes in lane_counts
    }
    found = {lanes: report for lanes, report in recalled.items() if report is not None}
    if len(found) == len(lane_counts):
        return list(found.values()), True
    tell(f"measuring {device.info.name}, once")
    sound = [lanes for lanes in lane_counts if lanes not in found or not found[lanes].fault]
    reports, is_known = _together(device, precision, sound, stopped)
    if len(sound) > 1 and any(report.fault for report in reports):
        # On which of them the driver fails is found out one by one; the others are compared then.
        alone = {}
        for lanes in sound:
            (alone[lanes],), is_known = _together(device, precision, [lanes], stopped)
            if alone[lanes].fault:
                found[lanes] = alone[lanes]
                _remember(device, precision, found[lanes], is_known)
        sound = [lanes for lanes in sound if not alone[lanes].fault]
        reports, is_known = _together(device, precision, sound, stopped)
        if any(report.fault for report in reports):
            reports, is_known = [alone[lanes] for lanes in sound], False
    for report in reports:
        found[report.lanes] = report
        _remember(device, precision, report, is_known)
    return [found[lanes] for lanes in lane_counts], is_known


def _together(
    device: Device, precision: Precision, lane_counts: Sequence[int], stopped: Callable[[], bool] | None
) -> tuple[list[MarchReport], bool]:
    """Of lane counts that take turns in one child process; all of them have its fault. And whether that is to be kept."""
    if not lane_counts:
        return [], True
    answer, is_known = tune.tried(
        JOB,
        device,
        {"lanes": list(lane_counts), "precision": precision},
        doing=f"marching with {' and '.join(map(str, lane_counts))} lanes",
        timeout_s=_TIMEOUT_S * len(lane_counts),
        stopped=stopped,
    )
    if "fault" in answer:
        return [MarchReport(lanes, 0.0, 0.0, str(answer["fault"])) for lanes in lane_counts], is_known
    times = zip(lane_counts, answer["scalar"], answer["jacobian"], strict=True)
    return [MarchReport(*each, "") for each in times], bool(answer["steady"])


def _remember(device: Device, precision: Precision, report: MarchReport, is_known: bool) -> None:
    if is_known:
        cache.remember(_SECTION, _name(device, precision, report.lanes), asdict(report))


def _key(device: Device, precision: Precision) -> tuple[str, str, str]:
    return str(cache.folder()), device.info.key, precision


def _name(device: Device, precision: Precision, lanes: int) -> str:
    """What a measurement is remembered under."""
    return tune.name_of(device, precision, lanes, JOB, _VERSION)


def march_job(request: Mapping[str, Any]) -> dict[str, Any]:
    """In a child process: marches the pictures with each of `request["lanes"]` in `request["precision"]`.

    Returns `scalar` and `jacobian`: nanoseconds a pixel with each lane count; and `steady`: whether they can be relied on.
    """
    device = select.by_key(*request["device"])
    lane_counts, precision = [int(lanes) for lanes in request["lanes"]], request["precision"]
    if select.is_simulator(device.info):
        # It would take minutes, and only tells that wide packets are fewer instructions.
        times = [1000000000.0 / lanes for lanes in lane_counts]
        return {**dict.fromkeys(RULES, times), "steady": True}
    answer: dict[str, Any] = {"steady": True}
    for rule in RULES:
        answer[rule], is_steady = _raced(device, precision, lane_counts, rule)
        answer["steady"] = answer["steady"] and is_steady
    return answer


def _raced(
    device: Device, precision: Precision, lane_counts: Sequence[int], rule: Rule
) -> tuple[list[float], bool]:
    """Nanoseconds a pixel by a rule with each lane count, and whether they can be relied on."""
    side = picture_side(device, rule)
    marchers = {lanes: Marcher(device, precision, lanes, rule, side) for lanes in lane_counts}
    # A device that is slow shall not look like one that hangs: a quarter of the limit is left to both rules' rounds.
    end = time.monotonic() + _TIMEOUT_S * len(lane_counts) / (4 * len(RULES))
    least, is_steady = compared(
        lane_counts, lambda lanes: marchers[lanes].milliseconds(), lambda: time.monotonic() > end
    )
    return [1e6 * least[lanes] / side**2 for lanes in lane_counts], is_steady
