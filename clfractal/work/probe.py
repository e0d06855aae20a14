"""Which job measures the lanes of a device."""

from __future__ import annotations

from clfractal.device import tune
from clfractal.device.select import DeviceInfo


def probe_for(info: DeviceInfo) -> str:
    """The job that measures lanes on a device."""
    return tune.DEFAULT_PROBE
