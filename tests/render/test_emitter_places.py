"""Places of lights (`emitter_places.h`, `rectangles.h`): each choice has the density that is told, and all is found."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, qmc

from clfractal.device.select import choose
from clfractal.device.structs import Precision
from clfractal.scene.model import Scene
from clfractal.shading.light_records import LIGHT
from tests.render.emitter_choices import LUMINANCE, axes_of, choices, expected, moments, shining
from tests.render.objects_oracle import met
from tests.render.shots import Floats
from tests.small_kernels import LOADS, SmallKernels
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


_TEXT = f"""\
#include "device/lanes.h"
#include "formulas/numbers/real.h"
#include "device/vectors.h"
#include "structs.h"
#include "integrators/sampling.h"
#include "geometry/rectangles.h"
#include "elements/lights/area_lights/rectangle.h"
{LOADS}
// Planes of `count` numbers. In: u, v. Out: the direction, its density.
__kernel void look(__global const scalar *in, __global scalar *out, light_record light, scalar x, scalar y,
                   scalar z, int count) {{
    const int lane = (int)get_global_id(0) * LANES;
    in += lane;
    out += lane;
    const vec point = vec_of((real)(x), (real)(y), (real)(z));
    const vec chosen = rectangle_light_direction(light, point, vec_of(R(0.0), R(0.0), R(1.0)), load(in), load(in + count));
    store(out, chosen.x);
    store(out + count, chosen.y);
    store(out + 2 * count, chosen.z);
    store(out + 3 * count, rectangle_light_density(light, point, chosen));
}}
"""
# A window of 3 by 1 that shines to -z, turned about z.
MIDDLE = np.array([0.3, -0.2, 2.0])
SIDE, UPWARD = 1.5 * np.array([0.8, 0.6, 0]), 0.5 * np.array([-0.6, 0.8, 0])


@cache
def window_kernels(precision: Precision, lanes: int) -> SmallKernels:
    structs = {"structs.h": LIGHT.c_text()}
    return SmallKernels(choose(), _TEXT, precision, lanes, generated=structs, defines={"PALETTE_SIZE": 256})


def looks(point: Floats, numbers: Floats, precision: Precision, lanes: int) -> tuple[Floats, Floats]:
    """Directions, shape (n, 3), and densities."""
    kernels = window_kernels(precision, lanes)
    values: dict[str, Any] = {
        field.name: (0.0,) * field.count if field.count else 0 for field in LIGHT.fields
    }
    values |= {"vector": MIDDLE, "axis": (0, 0, -1), "side": SIDE, "upward": UPWARD, "area": 3.0}
    count = len(numbers)
    given, out = kernels.planes(numbers.T), np.full((4, count), np.nan, precision)
    light = LIGHT.array(precision, [values])
    kernels.run("look", given, out, light, *kernels.scalars(point), np.int32(count), result=out)
    return out[:3].T.astype(float), out[3].astype(float)


def solid_angle(point: Floats) -> float:
    """Two triangles (Van Oosterom and Strackee, The Solid Angle of a Plane Triangle, 1983)."""
    corners = [MIDDLE + a * SIDE + b * UPWARD - point for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    a, b, c, d = (corner / np.linalg.norm(corner) for corner in corners)

    def triangle(p: Floats, q: Floats, r: Floats) -> float:
        above = abs(np.dot(p, np.cross(q, r)))
        return 2 * math.atan2(above, 1 + np.dot(p, q) + np.dot(q, r) + np.dot(r, p))

    return triangle(a, b, c) + triangle(a, c, d)


WINDOW_POINTS = {
    "below": [0.3, -0.2, 0.0],
    "aside": [4.0, 1.0, 0.5],
    "close": [0.5, 0.0, 1.99],
    "in its corner": [1.2, 0.7, 1.9],
    "far": [1.0, 2.0, -60.0],
}


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("lanes", [1, 8])
@pytest.mark.parametrize("where", WINDOW_POINTS)
def test_even_by_solid_angle(where: str, precision: Any, lanes: int) -> None:
    point = np.array(WINDOW_POINTS[where])
    numbers = np.clip(qmc.Sobol(2, seed=3).random(1 << 12), 1e-6, 1 - 1e-6)
    directions, densities = looks(point, numbers, precision, lanes)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-5)
    # Each meets the window.
    places = point + directions * ((MIDDLE - point)[2] / directions[:, 2])[:, None] - MIDDLE
    loose = 1 + 1e-3
    assert (np.abs(places @ SIDE) <= SIDE @ SIDE * loose).all()
    assert (np.abs(places @ UPWARD) <= UPWARD @ UPWARD * loose).all()
    # The mean of 1 / density is the solid angle, and where that is large densities are all the same.
    angle = solid_angle(point)
    assert np.mean(1 / densities) == pytest.approx(angle, rel=2e-3)
    if angle < 0.01:
        return
    assert np.allclose(densities * angle, 1, rtol=2e-3)
    # As many in each of 12 x 4 parts of the window as their solid angle says, by fine midpoints.
    fine = (np.arange(240) + 0.5) / 120 - 1
    x, y = np.meshgrid(fine, fine, indexing="ij")
    ways = MIDDLE + x[..., None] * SIDE + y[..., None] * UPWARD - point
    weight = ways[..., 2] / (ways**2).sum(-1) ** 1.5
    expected = weight.reshape(12, 20, 4, 60).sum(axis=(1, 3))
    expected *= len(numbers) / expected.sum()
    found, _, _ = np.histogram2d(
        places @ SIDE / (SIDE @ SIDE), places @ UPWARD / (UPWARD @ UPWARD), (12, 4), [[-1.001, 1.001]] * 2
    )
    seen = expected > 5
    assert ((found - expected)[seen] ** 2 / expected[seen]).sum() < chi2.ppf(0.999, seen.sum())
