"""A ray's result depends on the ray alone: not on how many lanes a packet has, nor on what its neighbours meet.

Regions, tiles and whole pictures agree only because of that.
"""

from __future__ import annotations

import pytest

from clfractal.device import tune
from clfractal.device.select import choose, has_float64, is_simulator
from clfractal.device.structs import Precision
from tests.portability.compare import difference
from tests.portability.pictures import picture

pytestmark = pytest.mark.conformance


def test_lane_counts_give_the_same_picture() -> None:
    """hast, whose needle shows the least difference of distances; float64, which leaves rounding no excuse."""
    device = choose()
    precision: Precision = "float64" if has_float64(device.info) else "float32"
    size = (12, 8) if is_simulator(device.info) else (64, 48)
    scalar = picture(device, "hast", precision, size, lanes=1)
    for lanes in {4, 16} & set(tune.accepted_lanes(device, precision)):
        found = difference(scalar, picture(device, "hast", precision, size, lanes=lanes), precision)
        assert not found.fault, f"{lanes} lanes: {found.fault}"
