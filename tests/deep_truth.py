"""Places of any depth, and what is true around them: by the formula's own tree with as many digits as it takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import yaml
from numpy.typing import NDArray

from clfractal.errors import Where
from clfractal.formulas import catalog
from clfractal.formulas.backends import MpmathBackend
from clfractal.formulas.chain import Chain
from clfractal.formulas.deep import begun_orbits
from clfractal.formulas.place import Place
from clfractal.formulas.reference import _mp_states, mp_escape
from clfractal.integrators.points import escape
from tests.devices import device

Floats = NDArray[np.float64]
MORE_DIGITS = 40
PLACES: Mapping[str, Any] = yaml.safe_load((Path(__file__).parent / "deep_places.yaml").read_text("utf-8"))
"""By formulas' names: the formula, an exact centre, and for each depth the applications that are fit for it."""
TIE = 2.0**-19
"""How far a point may be moved by what orbits begin with, as a part of its distance from the place: twice the bound."""
ROUNDED = 2.0**-50
"""What z is off by after some applications in float64, as a part of it."""


def all_depths() -> list[tuple[str, int]]:
    return [(name, depth) for name, each in PLACES.items() for depth in each["iterations"]]


@lru_cache
def plain(name: str) -> Chain:
    """The formula itself."""
    return catalog.resolve(PLACES[name]["formula"], None, Where(path="formula"))


def placed(name: str, depth: int, applications: int) -> Chain:
    return plain(name).placed(Place(tuple(PLACES[name]["center"]), 10.0**depth, applications))


def exact_point(name: str, depth: int, point: Sequence[Any] | Floats) -> list[Any]:
    """A point of the scene in the formula's own space, in mpmath's present precision."""
    # (As the program has it: magnifications are numbers of float64.)
    unit = 1 / mpmath.mpf(10.0**depth)
    near = (mpmath.mpf(p) if not isinstance(p, float) else mpmath.mpf(float(p)) for p in point)
    return [mpmath.mpf(c) + p * unit for c, p in zip(PLACES[name]["center"], near, strict=True)]


def exact_count(name: str, depth: int, point: Sequence[Any] | Floats, applications: int) -> int:
    digits = depth + MORE_DIGITS
    with mpmath.workdps(digits):
        return mp_escape(plain(name), exact_point(name, depth, point), applications, digits)[0]


def points_around(count: int, seed: int) -> Floats:
    """Some from a thousandth of a unit to a thousand units from the place."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-1, 1, (count, 3)) * 10.0 ** rng.integers(-3, 4, (count, 1))


def untold(name: str, chain: Chain, point: Floats) -> Floats:
    """How far a point may be moved without its begun orbit's noticing, shape (3, 3): a row for each direction.

    That is twice what straight orbits may be off, and what some roundings of z to float64 are, in the point's space.
    """
    place = chain.place
    assert place is not None
    away = float(np.linalg.norm(point))
    # (Entries are four times as wide as they are apart.)
    begun = next(each for each in reversed(begun_orbits(chain)) if each.reach >= 4 * away * place.scale)
    z = begun.state[: chain.size]
    _, spread, directions = np.linalg.svd(begun.slopes[: chain.size], full_matrices=False)
    rounded = ROUNDED * max(float(np.linalg.norm(z)), 1.0) / np.maximum(spread, 1e-300) * place.magnification
    moves: Floats = np.clip(rounded, TIE * away, away / 4)[:, None] * directions
    return moves


def counts_that_differ(name: str, depth: int, count: int, seed: int = 3) -> tuple[list[Any], int]:
    """Points around a place whose counts are not those of mpmath.

    Returns:
        Those whose neighbours, so near that begun orbits cannot tell them apart, have all the same count: the point, its
        count on the device, the true one; and how many others there are: ties.
    """
    applications = PLACES[name]["iterations"][depth]
    points = points_around(count, seed)
    chain = placed(name, depth, applications)
    got, _ = escape(chain, points, applications, device=device(), lanes=8, precision="float64")
    rng, wrong, ties = np.random.default_rng(seed + 1), [], 0
    for point, found in zip(points, map(int, got), strict=True):
        exact = exact_count(name, depth, point, applications)
        if exact == found:
            continue
        moves = rng.normal(size=(24, 3)) @ untold(name, chain, point)
        if any(exact_count(name, depth, point + move, applications) != exact for move in moves):
            ties += 1
        else:
            wrong.append((point.tolist(), found, exact))
    return wrong, ties


def is_inside(name: str, depth: int, point: Sequence[Any] | Floats, iterations: int) -> bool:
    """Whether a point of the scene is in the solid of so many applications, exactly."""
    chain = plain(name)
    with mpmath.workdps(depth + MORE_DIGITS):
        here = exact_point(name, depth, point)
        far = chain.bailout if chain.degree > 1 or not chain.has_solid else chain.distance_bailout
        for state in islice(_mp_states(chain, here, MpmathBackend(), mpmath.mpf), iterations + 1):
            if not mpmath.fsum(z * z for z in state[: chain.size]) <= mpmath.mpf(far) ** 2:
                break
        else:
            if chain.degree > 1:
                return True
        if chain.degree > 1:
            return False
        if chain.shape_index is not None:
            from clfractal.formulas.reference import _solid

            return bool(_solid(chain, chain.shape_index, state, MpmathBackend()) <= 0)
        radius = mpmath.mpf(chain.solid_radius)
        return bool(mpmath.fsum(z * z for z in state[: chain.size]) <= radius**2)
