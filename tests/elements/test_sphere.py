"""The ball and the ellipsoid by their equation, as all solids are tested."""

from __future__ import annotations

from typing import ClassVar

from tests.elements import solids
from tests.render.joined_oracle import a_sphere


class TestSphere(solids.Checks):
    KINDS: ClassVar = {
        name: solids.Known({"type": "sphere", "radius": 0.7}, a_sphere([0, 0, 0], 0.7), scale=scale)
        for name, scale in (("ball", [1.0, 1.0, 1.0]), ("egg", [1.4, 1.0, 0.6]))
    }
