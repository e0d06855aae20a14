"""The torus by its equation, (sqrt(x^2 + y^2) - radius)^2 + z^2 = tube^2: alone, joined, of glass, as a light."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.elements.shapes.torus import TorusObject
from clfractal.errors import SceneError
from tests.elements import solids
from tests.render.joined_oracle import Floats


def torus(radius: float, tube: float, **placed: Any) -> solids.Known:
    def distance(p: Floats) -> Floats:
        return np.asarray(np.hypot(np.hypot(p[..., 0], p[..., 1]) - radius, p[..., 2]) - tube)

    return solids.Known({"type": "torus", "radius": radius, "tube": tube}, distance, **placed)


class TestTorus(solids.AllChecks):
    KINDS: ClassVar = {
        "tyre": torus(0.6, 0.35),
        "ring": torus(0.8, 0.06),
        "horn": torus(0.5, 0.5),
        "uneven": torus(0.5, 0.2, scale=[1.6, 1.0, 0.6]),
    }
    JOINED: ClassVar = {"tyre": KINDS["tyre"], "uneven": torus(0.6, 0.4, scale=[1.5, 1.0, 0.8])}
    GLASS: ClassVar = ("tyre", "ring")
    LAMPS: ClassVar = ("tyre", "ring", "uneven")
    POINTS: ClassVar = {
        "over": [0.2, 0.1, 6.0],
        "beside": [-2.5, 0.4, 0.2],
        "in the hole": [0.05, -0.03, 0.1],
        "close": [0.8, 0.2, 1.4],
        "far": [20.0, -30.0, 25.0],
    }

    def test_a_ray_through_its_middle_and_along_its_plane(self, device: Device) -> None:
        """Along the axis nothing is met."""
        known = torus(0.8, 0.2, rotation=[0, 0, 0], position=[0, 0, 0])
        solids.check_alone(known, device, "perspective", "float32", None)
        solids.check_walls(known, device, [0.8, 0, 0])


def test_a_tube_that_leaves_no_ring_is_refused() -> None:
    with pytest.raises(SceneError, match=r"must be at most the ring's radius, 0\.2, got 0\.3"):
        TorusObject.checked({"radius": 0.2, "tube": 0.3, "type": "torus"})
