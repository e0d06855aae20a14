"""The ball and the ellipsoid by their equation, as all solids are tested."""

from __future__ import annotations

import numpy as np

from tests.devices import device
from tests.elements import solids
from tests.render.joined_oracle import Floats


def ball(points: Floats) -> Floats:
    found: Floats = np.linalg.norm(points, axis=-1) - 0.7
    return found


SPHERE = solids.Known({"type": "sphere", "radius": 0.7}, ball)
EGG = solids.Known({"type": "sphere", "radius": 0.7}, ball, scale=[1.4, 1.0, 0.6])


def test_a_ball_and_an_egg() -> None:
    for known in (SPHERE, EGG):
        solids.check_inside(known)
        solids.check_alone(known, device(), "perspective", "float32", None)
        solids.check_opened(known, device())
