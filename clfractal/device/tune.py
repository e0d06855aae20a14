"""Which lane counts work: tried once per device and driver, and remembered.

Each lane count is tried in a child process of its own. A driver may abort on one (PoCL's wheel on `sqrt` of a
`float16`, where the processor has no AVX-512), hang on another, or compute nonsense: all three reject it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, TypeVar

from clfractal.device import activity, cache, isolate
from clfractal.device.quirks import compiles_packets_slowly, vectorises_across_work_items
from clfractal.device.select import Device, has_float64
from clfractal.device.structs import Precision
from clfractal.errors import (
    STATUS_BAD_INPUT,
    STATUS_DEVICE_FAILED,
    ClfractalError,
    DeviceError,
    FileError,
    Stopped,
    UntriedError,
)

Report = TypeVar("Report")

LANE_COUNTS = (1, 4, 8, 16)
PROBE = "clfractal.device.lane_probe:lanes_job"
PROBE_TIMEOUT_S = 120.0

_VERSION = 7  # of the probes: older measurements no longer count
SECTION = "lanes"
"""Of the cache: reports of trials."""


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
    stopped: Callable[[], bool] | None = None,
) -> tuple[LaneReport, ...]:
    """A report for each lane count, tried if this device and driver were not tried before.

    Args:
        device: the device.
        precision: lanes are tried for each number type alone.
        lane_counts: some of LANE_COUNTS.
        on_start: told, once, that a measurement of some seconds begins.
        stopped: asked while a child process tries.

    Raises:
        DeviceError: status 2, the device has no float64.
        FileError: there is no room for what the driver writes.
        Stopped: `stopped` answered True.
    """
    if precision == "float64" and not has_float64(device.info):
        raise DeviceError(f"{device.info.name} has no float64", status=STATUS_BAD_INPUT)
    known = cache.recall(SECTION)
    reports = []
    for lanes in lane_counts:
        report = remembered(known, device, precision, lanes)
        if report is None:
            if on_start is not None:
                on_start(f"measuring {device.info.name}, once")
                on_start = None
            doing = f"trying {lanes} lanes"
            answer, is_known = tried(
                PROBE,
                device,
                {"lanes": lanes, "precision": precision},
                doing=doing,
                timeout_s=PROBE_TIMEOUT_S,
                stopped=stopped,
            )
            report = LaneReport(lanes, str(answer["fault"]))
            if is_known:
                name = name_of(device, precision, lanes, PROBE, _VERSION)
                cache.remember(SECTION, name, asdict(report))
        reports.append(report)
    return tuple(reports)


def remembered(
    known: Mapping[str, Any], device: Device, precision: Precision, lanes: int
) -> LaneReport | None:
    """The report of a lane count among facts of the cache; None if it was not tried yet, or by another version."""
    return recalled(LaneReport, known.get(name_of(device, precision, lanes, PROBE, _VERSION)))


def first_lanes(
    device: Device, precision: Precision, *, on_start: Callable[[str], None] | None = None
) -> int:
    """A lane count that works, and is probably fast: of those that are promising the one that fits the registers best.

    It is tried if this device and driver were not tried before, which takes about a second.

    Raises:
        DeviceError: as `lane_reports`; status 3 if no lane count works.
        FileError: as `lane_reports`.
    """
    fitting = device.cl_device.native_vector_width_float
    faults: list[str] = []
    for lane_counts in promising(device):
        for lanes in sorted(lane_counts, key=lambda count: abs(count - fitting)):
            (report,) = lane_reports(device, precision, (lanes,), on_start=on_start)
            if report.accepted:
                return lanes
            faults.append(f"{lanes} lanes: {report.fault}")
    raise none_works(device, faults)


def none_works(device: Device, faults: Sequence[str]) -> DeviceError:
    """What is to be said of a device on which each lane count has a fault."""
    name = device.info.name
    return DeviceError(f"{name}: no kernel works on this device: {faults[0]}", details="\n".join(faults))


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
    return (1, 8, 16), (4,)


def is_of_the_device(error: ClfractalError) -> bool:
    """Whether a trial failed by what the device or its driver does: only that will be so the next time.

    Memory that others use, a full disk, a process that was ended from outside say nothing of it.
    """
    return error.status == STATUS_DEVICE_FAILED and not isinstance(error, UntriedError)


def tried(
    job: str,
    device: Device,
    request: Mapping[str, Any],
    *,
    doing: str,
    timeout_s: float,
    stopped: Callable[[], bool] | None,
) -> tuple[dict[str, Any], bool]:
    """What a job in a child process answers about lane counts, or its `fault`; and whether that may be remembered.

    Args:
        request, doing, timeout_s, stopped: as of `isolate.run`.

    Raises:
        FileError: there is no room for what the driver writes.
        Stopped: `stopped` answered True.
    """
    try:
        with activity.doing(f"measuring {device.info.name}"):
            return isolate.run(job, device, request, doing=doing, timeout_s=timeout_s, stopped=stopped), True
    except (FileError, Stopped):
        raise
    except ClfractalError as error:
        return {"fault": error.message}, is_of_the_device(error)


def name_of(device: Device, precision: Precision, lanes: int, job: str, version: int) -> str:
    """What a trial by a job is remembered under."""
    return " | ".join((device.info.key, precision, str(lanes), job, str(version)))


def recalled(kind: type[Report], data: Any) -> Report | None:
    """A report that was remembered as data; None if there is none, or one by another version."""
    try:
        return kind(**data)
    except TypeError:
        return None
