"""Which lane counts tests try on a device."""

from __future__ import annotations

from clfractal.device import tune
from clfractal.device.quirks import compiles_packets_slowly
from clfractal.device.select import Device
from clfractal.device.structs import Precision


def counts_in_use(device: Device) -> tuple[int, ...]:
    """All; where packets take minutes to compile, those that the program tries first."""
    return tune.promising(device)[0] if compiles_packets_slowly(device.info) else tune.LANE_COUNTS


def accepted_in_use(device: Device, precision: Precision) -> tuple[int, ...]:
    """Those that work."""
    reports = tune.lane_reports(device, precision, counts_in_use(device))
    return tuple(report.lanes for report in reports if report.accepted)
