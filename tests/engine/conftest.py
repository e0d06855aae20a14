"""The device that pictures are rendered on: the one users get, or CLFRACTAL_DEVICE."""

from __future__ import annotations

import pytest

from clfractal.device.select import Device, choose


@pytest.fixture(scope="session")
def device() -> Device:
    return choose()
