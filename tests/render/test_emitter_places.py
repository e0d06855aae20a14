"""Places of objects that shine (`emitter_places.h`): each choice has the density that is told, and all is found."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

from clfractal.device.structs import Precision
from clfractal.scene.model import Scene
from tests.render.emitter_choices import LUMINANCE, axes_of, choices, expected, moments, shining
from tests.render.objects_oracle import met
from tests.render.shots import Floats
from tests.variants import one_of

PLACE = {"position": [0.3, -0.2, 0.1], "rotation": [20, 35, 50]}
SHAPES: dict[str, dict[str, Any]] = {
    "ball": {"type": "sphere", "radius": 0.4},
    "egg": {"type": "sphere", "radius": 0.5, "scale": [1, 2, 0.4]},
    "box": {"type": "box", "size": [0.5, 0.8, 1.1]},
    "panel": {"type": "box", "size": [2, 1, 0.02]},
    "drum": {"type": "cylinder", "radius": 0.5, "height": 0.3},
    "tube": {"type": "cylinder", "radius": 0.05, "height": 2},
    "flat tube": {"type": "cylinder", "radius": 0.4, "height": 1, "scale": [1, 0.3, 1]},
}
# Of the object's own half axes from its middle: over a lid, beside, at a corner, close to both, and far.
POINTS: dict[str, list[float]] = {
    "over": [0.3, 0.2, 3.0],
    "beside": [-2.5, 0.4, 0.2],
    "aslant": [1.8, -1.7, 1.6],
    "close": [0.5, 1.02, 0.3],
    "far": [20.0, -30.0, 25.0],
}


@cache
def scene(shape: str) -> Scene:
    """The object alone, in a light of its own."""
    return shining({**SHAPES[shape], **PLACE})


def axes(shape: str) -> Floats:
    return axes_of(scene(shape))


def look(shape: str, point: Floats, precision: Precision, lanes: int, count: int = 1 << 13) -> Floats:
    return choices(scene(shape), point, precision, lanes, count)


@cache
def known(shape: str, where: str) -> tuple[Floats, Floats, Floats]:
    point = np.array(PLACE["position"]) + np.array(POINTS[where]) @ axes(shape)
    return point, *expected(scene(shape), point, lambda o, d: met(scene(shape), o, d)[0])


@pytest.mark.parametrize(("precision", "lanes"), one_of(("float32", 8), ("float32", 1), ("float64", 8)))
@pytest.mark.parametrize("where", POINTS)
@pytest.mark.parametrize("shape", SHAPES)
def test_even_light_is_found_in_all_directions(shape: str, where: str, precision: Any, lanes: int) -> None:
    point, right, axis = known(shape, where)
    rows = look(shape, point, precision, lanes)
    way, density, by_chance = rows[:, :3], rows[:, 3], rows[:, 4]
    far = np.linalg.norm(way, axis=1)
    directions = way / far[:, None]
    # Places are on the object, on the side that is seen. (At rims rounding decides.)
    first = met(scene(shape), np.broadcast_to(point, directions.shape), directions)[0]
    assert (np.abs(first / far - 1) < 1e-3).mean() > 0.99
    # What is met by chance has the density with which it is asked for.
    same = np.abs(by_chance / density - 1) < 1e-2
    assert same.mean() > 0.995
    found = (moments(directions, axis) / density[:, None]).mean(axis=0)
    spread = np.sqrt((moments(directions, axis) ** 2 / density[:, None]).mean(axis=0) * right[0])
    assert (np.abs(found - right) < 0.01 * spread).all(), (found, right)
    # The weight is about the irradiance of what faces the object: pi of the luminance at most.
    assert 0.2 < rows[0, 5] / LUMINANCE / min(right[0], math.pi) < 5


@pytest.mark.parametrize("shape", SHAPES)
def test_nobody_asks_from_inside(shape: str) -> None:
    for where in ([0, 0, 0], [0.5, -0.4, 0.3], [0.1, 0.2, -0.95]):
        point = np.array(PLACE["position"]) + np.array(where) @ axes(shape)
        assert (look(shape, point, "float32", 8, 8)[:, 5] == 0).all()
    outside = np.array(PLACE["position"]) + np.array([0.1, 0.2, -1.05]) @ axes(shape)
    assert (look(shape, outside, "float32", 8, 8)[:, 5] > 0).all()
