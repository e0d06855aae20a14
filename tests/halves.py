"""The halves of a processor, as two devices."""

from __future__ import annotations

import pytest

from clfractal.device.select import Device
from clfractal.errors import DeviceError


def index_of(device: Device) -> str:
    """The device's index, as `--device` takes it."""
    return device.info.index


def halves_of(device: Device) -> str:
    """What names both halves of a device; the test is skipped where it cannot be divided."""
    units = device.info.compute_units
    if units < 2:
        pytest.skip("the device has one compute unit")
    half = units // 2
    try:
        device.divided((half, units - half))
    except DeviceError as error:
        pytest.skip(str(error))
    return f"{device.info.index}/{half}+{units - half}"
