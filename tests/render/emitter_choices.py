"""How paths ask a solid that shines for its light: a kernel that tells each choice, and what all of them have to be."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from clfractal.device.select import choose
from clfractal.device.structs import Precision
from clfractal.geometry.objects import object_defines, object_records
from clfractal.geometry.planes import CUT_PLANE
from clfractal.integrators.declarations import struct_text
from clfractal.scene.model import Scene
from clfractal.schema.shape import Solid
from clfractal.shading import emitters
from tests.render.objects_oracle import NOWHERE
from tests.render.shots import PERSPECTIVE, Floats
from tests.scenes import scene_of
from tests.small_kernels import LOADS, SmallKernels

Hits = Callable[[Floats, Floats], Floats]
"""How far rays from origins in directions go to the solid; infinite where they do not meet it."""

_TEXT = f"""\
#include "device/lanes.h"
#include "formulas/numbers/real.h"
#include "device/vectors.h"
#include "structs.h"
#include "integrators/camera.h"
#include "integrators/sampling.h"
#include "geometry/rectangles.h"
#include "geometry/objects.h"
#include "shading/emitter_places.h"
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


@contextmanager
def chance_alone() -> Iterator[None]:
    """Light that would have to be sought is found by chance alone meanwhile."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(emitters, "may_seek", lambda scene: False)
        yield


def shining(solid: dict[str, Any]) -> Scene:
    """The object alone, in a light of its own."""
    glow = {"emission": {"luminance": 2, "color": [1, 0.5, 0.25]}}
    return scene_of(
        NOWHERE,
        PERSPECTIVE,
        lighting={"mode": "path"},
        materials={"glow": glow},
        objects={"it": {**solid, "material": "glow"}},
    )


LUMINANCE = 2 * (0.2126 + 0.7152 * 0.5 + 0.0722 * 0.25)


def axes_of(scene: Scene) -> Floats:
    """The object's own half axes, as rows."""
    (it,) = scene.objects.values()
    assert isinstance(it, Solid)
    return np.asarray(np.array(it.axes))


@cache
def _kernels(precision: Precision, lanes: int, defines: tuple[tuple[str, object], ...]) -> SmallKernels:
    return SmallKernels(
        choose(),
        _TEXT,
        precision,
        lanes,
        generated={"structs.h": struct_text() + CUT_PLANE.c_text()},
        defines={"PALETTE_SIZE": 256, **dict(defines)},
    )


def choices(lit: Scene, point: Floats, precision: Precision, lanes: int, count: int = 1 << 13) -> Floats:
    """Ways, shape (n, 3), densities, those of meeting them, and weights: rows of 6 numbers."""
    kernels = _kernels(precision, lanes, tuple(object_defines(lit).items()))
    given = kernels.planes(np.clip(qmc.Sobol(3, seed=3).random(count), 1e-6, 1 - 1e-6).T)
    out, records = np.full((6, count), np.nan, precision), object_records(lit, precision)
    kernels.run("look", given, out, records, *kernels.scalars(point), np.int32(count), result=out)
    return out.T.astype(float)


def moments(directions: Floats, about: Floats) -> Floats:
    """1, and how far directions are from one, and their squares: what even light has to bring right."""
    offset = directions - about
    return np.asarray(np.concatenate([np.ones((len(offset), 1)), offset, offset**2], axis=1))


def expected(lit: Scene, point: Floats, hits: Hits, rays: int = 1 << 17) -> tuple[Floats, Floats]:
    """Integrals over all directions that meet the object, evenly spread in a cone around it; and the cone's axis.

    Args:
        rays: how many, or four times as many, until enough meet it.
    """
    (it,) = lit.objects.values()
    middle = np.array(it.position)
    reach, away = np.linalg.norm(axes_of(lit)), np.linalg.norm(middle - point)
    cosine = math.sqrt(1 - (reach / away) ** 2) if reach < away else -1.0
    spread = (reach / away) ** 2 / (1 + cosine) if reach < away else 2.0
    axis = (middle - point) / away
    side = np.cross(axis, [0.6, -0.48, 0.64])
    side /= np.linalg.norm(side)
    up = np.cross(axis, side)
    while True:
        u, v = qmc.Sobol(2, seed=5).random(rays).T
        low = spread * u
        wide, turn = np.sqrt(low * (2 - low)), 2 * np.pi * v
        ways = (
            np.outer(1 - low, axis) + np.outer(wide * np.cos(turn), side) + np.outer(wide * np.sin(turn), up)
        )
        hit = np.isfinite(hits(np.broadcast_to(point, ways.shape), ways))
        if hit.sum() > 4000 or rays >= 1 << 19:
            break
        rays *= 4
    assert hit.sum() > 1000
    return moments(ways, axis)[hit].sum(axis=0) * (2 * np.pi * spread / len(ways)), axis
