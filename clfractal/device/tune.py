"""Which lane counts work: tried once per device and driver, and remembered. (The fastest: `renderers/lanes.py`.)

Each lane count is tried in a child process of its own. A driver may abort on one (PoCL's wheel on `sqrt` of a
`float16`, where the processor has no AVX-512), hang on another, or compute nonsense: all three reject it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from clfractal.device import activity, cache, isolate
from clfractal.device.select import Device, compiles_packets_slowly, has_float64, vectorises_across_work_items
from clfractal.device.structs import Precision
from clfractal.errors import (
    STATUS_BAD_INPUT,
    STATUS_DEVICE_FAILED,
    ClfractalError,
    DeviceError,
    FileError,
    UntriedError,
)

LANE_COUNTS = (1, 4, 8, 16)
PROBE = "clfractal.device.probe:lanes_job"
PROBE_TIMEOUT_S = 120.0

_VERSION = 7  # of the probes: older measurements no longer count
_SECTION = "lanes"


@dataclass(frozen=True, slots=True)
class LaneReport:
    """What a trial of one lane count found; `fault` is empty if it may be used."""

    lanes: int
    fault: str

    @property
    def accepted(self) -> bool:
        return not self.fault


def lane_reports(
    device: Device,
    precision: Precision,
    lane_counts: Sequence[int] = LANE_COUNTS,
    *,
    on_start: Callable[[str], None] | None = None,
) -> tuple[LaneReport, ...]:
    """A report for each lane count, tried if this device and driver were not tried before.

    Args:
        device: the device.
        precision: lanes are tried for each number type alone.
        lane_counts: some of LANE_COUNTS.
        on_start: told, once, that a measurement of some seconds begins.

    Raises:
        DeviceError: status 2, the device has no float64.
        FileError: there is no room for what the driver writes.
    """
    if precision == "float64" and not has_float64(device.info):
        raise DeviceError(f"{device.info.name} has no float64", status=STATUS_BAD_INPUT)
    remembered = cache.recall(_SECTION)
    reports = []
    for lanes in lane_counts:
        key = " | ".join((device.info.key, precision, str(lanes), PROBE, str(_VERSION)))
        report = _from_data(remembered.get(key))
        if report is None:
            if on_start is not None:
                on_start(f"measuring {device.info.name}, once")
                on_start = None
            report, is_known = _try(device, precision, lanes)
            if is_known:
                cache.remember(_SECTION, key, asdict(report))
        reports.append(report)
    return tuple(reports)


def accepted_lanes(device: Device, precision: Precision) -> tuple[int, ...]:
    """All lane counts that work on the device.

    Raises:
        DeviceError: as `lane_reports`.
    """
    return tuple(report.lanes for report in lane_reports(device, precision) if report.accepted)


def promising(device: Device) -> tuple[tuple[int, ...], ...]:
    """Groups of lane counts; a group is tried if none before it works. Each trial costs seconds."""
    if compiles_packets_slowly(device.info):
        return (1,), (4,), (8,), (16,)
    if not vectorises_across_work_items(device.info):
        return (16, 8), (4, 1)
    if device.info.kind == "cpu":
        return (1, 8, 16), (4,)
    return (1, 4), (8, 16)


def is_of_the_device(error: ClfractalError) -> bool:
    """Whether a trial failed by what the device or its driver does: only that will be so the next time.

    Memory that others use, a full disk, a process that was ended from outside say nothing of it.
    """
    return error.status == STATUS_DEVICE_FAILED and not isinstance(error, UntriedError)


def _try(device: Device, precision: Precision, lanes: int) -> tuple[LaneReport, bool]:
    """The report, and whether it may be remembered."""
    try:
        with activity.doing(f"measuring {device.info.name}"):
            answer = isolate.run(
                PROBE,
                device,
                {"lanes": lanes, "precision": precision},
                doing=f"trying {lanes} lanes",
                timeout_s=PROBE_TIMEOUT_S,
            )
    except FileError:
        raise
    except ClfractalError as error:
        return LaneReport(lanes, error.message), is_of_the_device(error)
    return LaneReport(lanes, str(answer["fault"])), True


def _from_data(data: Any) -> LaneReport | None:
    try:
        return LaneReport(**data)
    except TypeError:  # nothing remembered, or by another version
        return None
