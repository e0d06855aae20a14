"""Level sets of |z| after some applications, and where they face: finite differences of the formula alone, in float64."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.formulas.backends import NumpyBackend
from clfractal.formulas.chain import Chain
from clfractal.formulas.reference import apply, constant_of, space_to_state

Floats = npt.NDArray[np.float64]

STEP = 1e-7
# Formulas that stretch space unevenly: an application more turns the normal by degrees.
UNEVEN = ("hast", "aexion", "makin_brot", "tetrabrot", "riemann_sphere")
CAMERA = {"position": [1.7, -2.9, 1.4], "target": [0, 0, 0], "frame": "all"}
# Another formula that is joined to one of them.
BESIDE: dict[str, Any] = {
    "type": "formula",
    "formula": {"name": "makin_brot", "iterations": 4},
    "position": [1.6, 0.4, 0.3],
    "rotation": [20, 10, 40],
    "scale": 0.6,
}


def orbit(chain: Chain, points: Floats, applications: int) -> Iterator[list[Floats]]:
    """z after 1, 2, ... applications, of points of shape (n, 3)."""
    backend = NumpyBackend()
    columns: list[Any] = [np.array(column, float) for column in points.T]
    with np.errstate(all="ignore"):
        point = [np.broadcast_to(p, columns[0].shape) for p in space_to_state(chain, columns, backend)]
        state: list[Any] = [np.zeros_like(p) for p in point] if chain.add == "point" else list(point)
        for application in range(applications):
            bound = chain.link_at(application).bound
            mapped = apply(bound, state, constant_of(bound, point), backend)
            state = [np.broadcast_to(np.asarray(z, float), columns[0].shape).copy() for z in mapped]
            yield state


def sizes(chain: Chain, points: Floats, applications: int) -> Floats:
    """|z| after 1, 2, ... applications, shape (applications, n), of points of shape (n, 3)."""
    with np.errstate(all="ignore"):
        return np.array([np.linalg.norm(z, axis=0) for z in orbit(chain, points, applications)])


def slopes(chain: Chain, points: Floats, applications: int) -> Floats:
    """How |z| after so many applications changes along x, y and z, shape (n, 3)."""

    def size(at: Floats) -> Floats:
        return np.asarray(sizes(chain, at, applications)[-1])

    with np.errstate(all="ignore"):
        ways = [(size(points + STEP * e) - size(points - STEP * e)) / (2 * STEP) for e in np.eye(3)]
    return np.stack(ways, axis=-1)


def onto_level(chain: Chain, points: Floats, applications: int, level: float) -> Floats:
    """The points moved down or up the slope to where |z| is the level, by Newton's method over its logarithm."""
    for _ in range(12):
        size, slope = sizes(chain, points, applications)[-1], slopes(chain, points, applications)
        with np.errstate(all="ignore"):
            points = points - (np.log(size / level) * size / (slope**2).sum(-1))[:, None] * slope
    return points


def inside(chain: Chain, points: Floats, applications: int) -> npt.NDArray[np.bool_]:
    """Which points belong to the solid of so many applications."""
    size = sizes(chain, points, applications)
    return np.asarray((size <= chain.distance_bailout).all(axis=0) & (size[-1] <= chain.bailout))


def along(
    chain: Chain, points: Floats, normals: Floats, applications: int, reach: float, looks: int = 30
) -> Floats:
    """The solid's surface straight above points that are inside, and straight below others: where lines along their
    normals first pass it, just outside; NaN where they do not, looked at so often within reach."""
    began = inside(chain, points, applications)
    way = np.where(began, 1.0, -1.0)[:, None] * normals
    part, past = reach / looks, np.full(len(points), np.nan)
    for look in range(1, looks + 1):
        passed = inside(chain, points + look * part * way, applications) != began
        past = np.where(np.isnan(past) & passed, look * part, past)
    before = past - part
    for _ in range(40):
        middle = (before + past) / 2
        passed = inside(chain, points + middle[:, None] * way, applications) != began
        before, past = np.where(passed, before, middle), np.where(passed, middle, past)
    return points + np.where(began, past, before)[:, None] * way


def degrees(normals: Floats, expected: Floats) -> Floats:
    """Angles between normals and directions of any length."""
    with np.errstate(all="ignore"):
        unit = expected / np.linalg.norm(expected, axis=-1, keepdims=True)
    return np.asarray(np.degrees(np.arccos(np.clip((normals * unit).sum(-1), -1, 1))))
