"""Rectangles as points see them (`rectangles.h`): chosen evenly by solid angle, from wherever they are seen."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, qmc

from clfractal.device.select import choose
from clfractal.device.structs import Precision
from clfractal.shading.light_records import LIGHT
from tests.small_kernels import LOADS, Floats, SmallKernels

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
__kernel void look(__global const scalar *in, __global scalar *out, __constant struct Light *light, scalar x, scalar y,
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


def look(point: Floats, numbers: Floats, precision: Precision, lanes: int) -> tuple[Floats, Floats]:
    """Directions, shape (n, 3), and densities."""
    structs = {"structs.h": LIGHT.c_text()}
    kernels = SmallKernels(
        choose(), _TEXT, precision, lanes, generated=structs, defines={"PALETTE_SIZE": 256}
    )
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


POINTS = {
    "below": [0.3, -0.2, 0.0],
    "aside": [4.0, 1.0, 0.5],
    "close": [0.5, 0.0, 1.99],
    "in its corner": [1.2, 0.7, 1.9],
    "far": [1.0, 2.0, -60.0],
}


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("lanes", [1, 8])
@pytest.mark.parametrize("where", POINTS)
def test_even_by_solid_angle(where: str, precision: Any, lanes: int) -> None:
    point = np.array(POINTS[where])
    numbers = np.clip(qmc.Sobol(2, seed=3).random(1 << 12), 1e-6, 1 - 1e-6)
    directions, densities = look(point, numbers, precision, lanes)
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
