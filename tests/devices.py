"""The device that programs are tested on, for tests that take it by no fixture, and what it can run."""

from __future__ import annotations

from functools import lru_cache

import pytest

from clfractal.device.select import Device, choose, has_float64
from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes


@lru_cache
def device() -> Device:
    return choose()


def usable(precision: Precision) -> bool:
    """A device without float64 has nothing to show in it; the message for users is tested elsewhere."""
    return precision == "float32" or has_float64(device().info)


def check_usable(precision: Precision, lanes: int | None = None) -> None:
    """Skips a number type or a lane count that the engine would not use: on such a driver aborts, or crashes."""
    if not usable(precision):
        pytest.skip(f"{device().info.name} has no {precision}")
    if lanes is not None and lanes not in accepted_lanes(device(), precision):
        pytest.skip(f"{device().info.name} cannot run {lanes} lanes of {precision}")
