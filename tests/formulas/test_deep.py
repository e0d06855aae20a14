"""Where orbits of deep places begin, beside exact ones."""

from __future__ import annotations

import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from clfractal.formulas.deep import NEAREST, STEP, Begun, begun_orbits
from clfractal.formulas.deep_table import HEAD, table_of
from clfractal.formulas.events import STRAIGHT
from clfractal.formulas.reference import mp_orbit
from tests.deep_truth import (
    MORE_DIGITS,
    PLACES,
    TIE,
    all_depths,
    counts_that_differ,
    exact_point,
    placed,
    plain,
)
from tests.devices import check_usable

DEEPEST = [(name, max(each["iterations"])) for name, each in PLACES.items()]
QUICK = [(name, depth) for name, depth in all_depths() if depth == 20]


def begun(name: str, depth: int) -> tuple[Begun, ...]:
    return begun_orbits(placed(name, depth, PLACES[name]["iterations"][depth]))


@pytest.mark.parametrize(("name", "depth"), DEEPEST)
def test_later_beginnings_reach_less_far(name: str, depth: int) -> None:
    found = begun(name, depth)
    assert [each.count for each in found] == list(range(found[0].count, found[0].count + len(found)))
    assert math.isinf(found[0].reach)
    assert all(a.reach >= b.reach for a, b in pairwise(found))
    # They are what the magnification is for: most applications are behind the last of them.
    assert found[-1].count > 0.2 * PLACES[name]["iterations"][depth]


def off(name: str, depth: int, each: Begun, point: NDArray[np.float64]) -> float:
    """How far z of a begun orbit is from the exact one, as a part of how far the map moves it at most."""
    size = plain(name).size
    with mpmath.workdps(depth + 2 * MORE_DIGITS):
        moved = [mpmath.mpf(float(p)) for p in point]
        center = [mpmath.mpf(c) for c in PLACES[name]["center"]]
        chain, digits = plain(name), depth + 2 * MORE_DIGITS
        here = mp_orbit(chain, [c + p for c, p in zip(center, moved, strict=True)], each.count, digits)[-1]
        there = mp_orbit(chain, center, each.count, digits)[-1]
        away = np.array([float(a - b) for a, b in zip(here, there, strict=True)][:size])
    most = float(np.linalg.norm(each.slopes[:size], 2)) * float(np.linalg.norm(point))
    return float(np.linalg.norm(each.slopes[:size] @ point - away)) / most


@pytest.mark.parametrize(("name", "depth"), DEEPEST)
def test_begun_orbits_are_exact_up_to_their_reach(name: str, depth: int) -> None:
    rng = np.random.default_rng(7)
    found = [each for each in begun(name, depth) if math.isfinite(each.reach)]
    for each in found[-1 :: -max(len(found) // 3, 1)]:
        direction = rng.normal(size=3)
        assert off(name, depth, each, direction / np.linalg.norm(direction) * each.reach) < STRAIGHT


@pytest.mark.parametrize(("name", "depth"), DEEPEST)
def test_states_of_a_place_are_its_own(name: str, depth: int) -> None:
    last = begun(name, depth)[-1]
    with mpmath.workdps(depth + MORE_DIGITS):
        center = [mpmath.mpf(c) for c in PLACES[name]["center"]]
    exact = mp_orbit(plain(name), center, last.count, depth + MORE_DIGITS)[-1]
    np.testing.assert_allclose(last.state, [float(z) for z in exact], rtol=1e-15)


@pytest.mark.parametrize("name", PLACES)
def test_entries_of_the_table_are_those_that_reach_far_enough(name: str) -> None:
    chain = placed(name, 20, PLACES[name]["iterations"][20])
    table = table_of(chain)
    lowest, count, width, unit, own, first = table[:HEAD]
    assert (lowest, unit, first) == (2 * NEAREST, 1e-20, begun_orbits(chain)[0].count)
    numbers = table[HEAD + 4 * chain.size : int(own)]
    assert len(numbers) == count * width
    reaches = {each.count: each.reach for each in begun_orbits(chain)}
    counts = [numbers[int(width) * index] for index in range(int(count))]
    for index, begins in enumerate(counts):
        assert reaches[int(begins)] >= 1e-20 * 2.0 ** (NEAREST + STEP * (index + 1))
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[-1]


def test_the_bound_of_ties_is_twice_that_of_orbits() -> None:
    assert TIE == 2 * STRAIGHT


@pytest.mark.parametrize(("name", "depth"), QUICK)
def test_counts_are_exact(name: str, depth: int) -> None:
    check_usable("float64", 8)
    wrong, ties = counts_that_differ(name, depth, 8)
    assert wrong == []
    assert ties <= 4


@pytest.mark.combination
@pytest.mark.parametrize(("name", "depth"), all_depths())
def test_all_counts_are_exact(name: str, depth: int) -> None:
    check_usable("float64", 8)
    wrong, ties = counts_that_differ(name, depth, 300)
    assert wrong == []
    assert ties <= 120


def test_a_point_is_where_it_is_told() -> None:
    with mpmath.workdps(80):
        x, _, _ = exact_point("hast", 20, (0.5, 0.0, 0.0))
        assert float((x - mpmath.mpf(PLACES["hast"]["center"][0])) * 10**20) == pytest.approx(0.5)
