"""The device that programs are tested on, for tests that take it by no fixture."""

from __future__ import annotations

from functools import lru_cache

from clfractal.device.select import Device, choose, has_float64
from clfractal.device.structs import Precision


@lru_cache
def device() -> Device:
    return choose()


def usable(precision: Precision) -> bool:
    """A device without float64 has nothing to show in it; the message for users is tested elsewhere."""
    return precision == "float32" or has_float64(device().info)
