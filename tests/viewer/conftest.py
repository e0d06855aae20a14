"""The device that pictures are rendered on, with a context of its own: a session has a thread."""

from __future__ import annotations

import pytest

from clfractal.device.select import Device, choose


@pytest.fixture(scope="session")
def device() -> Device:
    return choose().reopened()
