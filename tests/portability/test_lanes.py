"""A ray's result depends on the ray alone: not on how many lanes a packet has, nor on what its neighbours meet.

Regions, tiles and whole pictures agree only because of that.
"""

from __future__ import annotations

import pytest

from clfractal.device.select import choose, has_float64, is_simulator
from clfractal.device.structs import Precision
from tests.portability.compare import difference
from tests.portability.lane_counts import accepted_in_use
from tests.portability.pictures import picture

pytestmark = pytest.mark.conformance

# Share of pixels with other bits: float64 has none with PoCL and Intel, but a library may round its vector functions
# in another way than its scalar ones. Distances that depended on the neighbours changed 12 %. In float32 packets may
# estimate reciprocal roots in another way.
_OTHER_BITS = {"float32": 1.0, "float64": 0.01}


def test_lane_counts_give_the_same_picture() -> None:
    """hast, whose needle shows the least difference of distances; float64, which leaves rounding no excuse."""
    device = choose()
    precision: Precision = "float64" if has_float64(device.info) else "float32"
    size = (12, 8) if is_simulator(device.info) else (64, 48)
    scalar = picture(device, "hast", precision, size, lanes=1)
    tried = accepted_in_use(device, precision)
    # The widest has the most neighbours.
    for lanes in ({4} & set(tried) | {max(tried)}) - {1}:
        packet = picture(device, "hast", precision, size, lanes=lanes)
        other_bits = float((scalar != packet).any(axis=0).mean())
        assert other_bits <= _OTHER_BITS[precision], f"{lanes} lanes: {other_bits:.1%} of the pixels differ"
        assert not difference(scalar, packet, precision).fault
