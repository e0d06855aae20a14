"""Places of objects that shine (`kernels/emitter_places.h`): each choice has the density that is told, and all is found."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from clfractal.device.select import choose
from clfractal.device.structs import Precision
from clfractal.renderers.declarations import struct_text
from clfractal.renderers.objects import object_defines, object_records
from clfractal.renderers.planes import CUT_PLANE
from clfractal.scene.model import Scene
from tests.render.objects_oracle import NOWHERE, met
from tests.render.shots import PERSPECTIVE, Floats
from tests.scenes import scene_of
from tests.small_kernels import LOADS, SmallKernels
from tests.variants import one_of

_TEXT = f"""\
#include "lanes.h"
#include "numbers/real.h"
#include "vectors.h"
#include "structs.h"
#include "camera.h"
#include "sampling.h"
#include "rectangles.h"
#include "objects.h"
#include "emitter_places.h"
{LOADS}
// Planes of `count` numbers. In: u, v, choice. Out: the way to a place, the density of its choice, that of meeting it by
// chance, and the object's weight.
__kernel void look(__global const scalar *in, __global scalar *out, __global const struct Object *o, scalar x, scalar y,
                   scalar z, int count) {{
    const int lane = (int)get_global_id(0) * LANES;
    in += lane;
    out += lane;
    const vec point = vec_of((real)(x), (real)(y), (real)(z));
    const emitter_place found = emitter_chosen(o, &point, load(in + 2 * count), load(in), load(in + count));
    const vec way = emitter_in_space(o, found.way), toward = vec_normalize(way);
    store(out, way.x);
    store(out + count, way.y);
    store(out + 2 * count, way.z);
    store(out + 3 * count, found.density);
    store(out + 4 * count, emitter_density(o, &point, &toward, sqrt(vec_dot(way, way))));
    store(out + 5 * count, emitter_weight(o, &point));
}}
"""
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
    glow = {"emission": {"luminance": 2, "color": [1, 0.5, 0.25]}}
    return scene_of(
        NOWHERE,
        PERSPECTIVE,
        lighting={"mode": "path"},
        materials={"glow": glow},
        objects={"it": {**SHAPES[shape], **PLACE, "material": "glow"}},
    )


def axes(shape: str) -> Floats:
    """The object's own half axes, as rows."""
    (it,) = scene(shape).objects.values()
    found: Floats = np.array(it.axes)  # type: ignore[attr-defined]
    return found


def look(shape: str, point: Floats, precision: Precision, lanes: int, count: int = 1 << 13) -> Floats:
    """Ways, shape (n, 3), densities, those of meeting them, and weights: rows of 6 numbers."""
    lit = scene(shape)
    kernels = SmallKernels(
        choose(),
        _TEXT,
        precision,
        lanes,
        generated={"structs.h": struct_text() + CUT_PLANE.c_text()},
        defines={"PALETTE_SIZE": 256, **object_defines(lit)},
    )
    given = kernels.planes(np.clip(qmc.Sobol(3, seed=3).random(count), 1e-6, 1 - 1e-6).T)
    out, records = np.full((6, count), np.nan, precision), object_records(lit, precision)
    kernels.run("look", given, out, records, *kernels.scalars(point), np.int32(count), result=out)
    return out.T.astype(float)


def moments(directions: Floats, about: Floats) -> Floats:
    """1, and how far directions are from one, and their squares: what even light has to bring right."""
    offset = directions - about
    found: Floats = np.concatenate([np.ones((len(offset), 1)), offset, offset**2], axis=1)
    return found


def expected(shape: str, point: Floats) -> tuple[Floats, Floats]:
    """Integrals over all directions that meet the object, evenly spread in a cone around it; and the cone's axis."""
    middle = np.array(PLACE["position"])
    reach, away = np.linalg.norm(axes(shape)), np.linalg.norm(middle - point)
    cosine = math.sqrt(1 - (reach / away) ** 2) if reach < away else -1.0
    spread = (reach / away) ** 2 / (1 + cosine) if reach < away else 2.0
    u, v = qmc.Sobol(2, seed=5).random(1 << 19).T
    low = spread * u
    wide, turn = np.sqrt(low * (2 - low)), 2 * np.pi * v
    axis = (middle - point) / away
    side = np.cross(axis, [0.6, -0.48, 0.64])
    side /= np.linalg.norm(side)
    up = np.cross(axis, side)
    ways = np.outer(1 - low, axis) + np.outer(wide * np.cos(turn), side) + np.outer(wide * np.sin(turn), up)
    hit = np.isfinite(met(scene(shape), np.broadcast_to(point, ways.shape), ways)[0])
    assert hit.sum() > 1000
    return moments(ways, axis)[hit].sum(axis=0) * (2 * np.pi * spread / len(ways)), axis


@cache
def known(shape: str, where: str) -> tuple[Floats, Floats, Floats]:
    point = np.array(PLACE["position"]) + np.array(POINTS[where]) @ axes(shape)
    return point, *expected(shape, point)


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
    luminance = 2 * (0.2126 + 0.7152 * 0.5 + 0.0722 * 0.25)
    assert 0.2 < rows[0, 5] / luminance / min(right[0], math.pi) < 5


@pytest.mark.parametrize("shape", SHAPES)
def test_nobody_asks_from_inside(shape: str) -> None:
    for where in ([0, 0, 0], [0.5, -0.4, 0.3], [0.1, 0.2, -0.95]):
        point = np.array(PLACE["position"]) + np.array(where) @ axes(shape)
        assert (look(shape, point, "float32", 8, 8)[:, 5] == 0).all()
    outside = np.array(PLACE["position"]) + np.array([0.1, 0.2, -1.05]) @ axes(shape)
    assert (look(shape, outside, "float32", 8, 8)[:, 5] > 0).all()
