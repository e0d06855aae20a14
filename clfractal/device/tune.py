"""Measured once per device and driver, and remembered: lane counts that work, the fastest of them, FMA peak.

Each lane count is tried in a child process of its own. A driver may abort on one (PoCL's wheel on `sqrt` of a
`float16`, where the processor has no AVX-512), hang on another, or compute nonsense: all three reject it.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from clfractal.device import cache, isolate
from clfractal.device.select import SPEEDS, Device, has_float64, vectorises_across_work_items
from clfractal.device.structs import Precision
from clfractal.errors import STATUS_BAD_INPUT, ClfractalError, DeviceError

LANES_VARIABLE = "CLFRACTAL_LANES"
LANE_COUNTS = (1, 4, 8, 16)
DEFAULT_PROBE = "clfractal.device.probe:lanes_job"
PROBE_TIMEOUT_S = 120.0

_VERSION = 3  # of the probes: older measurements no longer count
_SECTION = "lanes"


@dataclass(frozen=True, slots=True)
class LaneReport:
    """What a trial of one lane count gave; `fault` is empty if it may be used."""

    lanes: int
    milliseconds: float
    points_per_second: float
    fault: str

    @property
    def accepted(self) -> bool:
        return not self.fault


def lane_reports(
    device: Device,
    precision: Precision,
    lane_counts: Sequence[int] = LANE_COUNTS,
    *,
    probe: str = DEFAULT_PROBE,
    on_start: Callable[[str], None] | None = None,
) -> tuple[LaneReport, ...]:
    """A report for each lane count, measured if this device and driver were not measured before.

    Args:
        device: the device.
        precision: lanes are tried for each number type alone.
        lane_counts: some of LANE_COUNTS.
        probe: the job that tries one lane count: it gets `lanes` and `precision` and returns `milliseconds`,
            `points_per_second` (of the same work on every device, since it compares them) and `fault`.
        on_start: told, once, that a measurement of some seconds begins.

    Raises:
        DeviceError: status 2, the device has no float64.
    """
    if precision == "float64" and not has_float64(device.info):
        raise DeviceError(f"{device.info.name} has no float64", status=STATUS_BAD_INPUT)
    remembered = cache.recall(_SECTION)
    reports = []
    for lanes in lane_counts:
        key = " | ".join((device.info.key, precision, str(lanes), probe, str(_VERSION)))
        report = _from_data(remembered.get(key))
        if report is None:
            if on_start is not None:
                on_start(f"measuring {device.info.name}, once")
                on_start = None
            report = _try(device, precision, lanes, probe)
            cache.remember(_SECTION, key, asdict(report))
        reports.append(report)
    return tuple(reports)


def accepted_lanes(device: Device, precision: Precision, *, probe: str = DEFAULT_PROBE) -> tuple[int, ...]:
    """All lane counts that work on the device.

    Raises:
        DeviceError: as `lane_reports`.
    """
    return tuple(report.lanes for report in lane_reports(device, precision, probe=probe) if report.accepted)


def best_lanes(
    device: Device,
    precision: Precision,
    *,
    probe: str = DEFAULT_PROBE,
    on_start: Callable[[str], None] | None = None,
) -> int:
    """The fastest lane count, or what the environment variable CLFRACTAL_LANES says.

    Raises:
        DeviceError: status 2 for a variable that is no lane count, and as `lane_reports`; status 3 if no
            lane count works.
    """
    override = os.environ.get(LANES_VARIABLE, "").strip()
    if override:
        if override not in map(str, LANE_COUNTS):
            known = ", ".join(map(str, LANE_COUNTS))
            raise DeviceError(
                f"{LANES_VARIABLE} must be one of {known}, got {override!r}", status=STATUS_BAD_INPUT
            )
        return int(override)
    faults = []
    for lane_counts in _promising(device):
        reports = lane_reports(device, precision, lane_counts, probe=probe, on_start=on_start)
        accepted = [report for report in reports if report.accepted]
        if accepted:
            best = min(accepted, key=lambda report: report.milliseconds)
            if precision == "float32":
                cache.remember(SPEEDS, device.info.key, best.points_per_second)
            return best.lanes
        faults += [f"{report.lanes} lanes: {report.fault}" for report in reports]
    raise DeviceError(
        f"{device.info.name}: no kernel works on this device: {faults[0]}", details="\n".join(faults)
    )


def _promising(device: Device) -> tuple[tuple[int, ...], ...]:
    """Groups of lane counts; a group is tried if none before it works. Each trial costs seconds."""
    if not vectorises_across_work_items(device.info):
        return (16, 8), (4, 1)
    if device.info.kind == "cpu":
        return (1, 8, 16), (4,)
    return (1, 4), (8, 16)


def _try(device: Device, precision: Precision, lanes: int, probe: str) -> LaneReport:
    try:
        answer = isolate.run(
            probe,
            device,
            {"lanes": lanes, "precision": precision},
            doing=f"trying {lanes} lanes",
            timeout_s=PROBE_TIMEOUT_S,
        )
    except ClfractalError as error:
        return LaneReport(lanes, 0.0, 0.0, error.message)
    return LaneReport(
        lanes, float(answer["milliseconds"]), float(answer["points_per_second"]), str(answer["fault"])
    )


def _from_data(data: Any) -> LaneReport | None:
    try:
        return LaneReport(**data)
    except TypeError:  # nothing remembered, or by another version
        return None
