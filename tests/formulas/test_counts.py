"""Escape counts against the reference tables, and against 40-digit arithmetic."""

from __future__ import annotations

import numpy as np
import pytest

from clfractal.formulas import catalog
from clfractal.formulas.reference import escape, mp_escape, mp_orbit
from tests.formulas.escape_tables import CASES, TABLES, chain_of


@pytest.mark.parametrize("case", sorted(CASES))
def test_every_count_of_the_tables(case: str) -> None:
    table = np.loadtxt(TABLES / f"{case}.csv", delimiter=",", skiprows=1)
    assert len(table) >= CASES[case].get("points", 60)
    setting = CASES[case]
    count, inside = escape(chain_of(case), table[:, :3], int(setting["iterations"]), setting["bailout"])
    np.testing.assert_array_equal(count, table[:, 3])
    np.testing.assert_array_equal(inside, table[:, 4] == 1)


@pytest.mark.parametrize("name", catalog.names())
def test_counts_agree_with_40_digits(name: str) -> None:
    chain = catalog.load_chain(name)
    points = np.random.default_rng(2).uniform(-1, 1, (12, 3)) * chain.radius * 0.6
    count, inside = escape(chain, points, 8)
    for point, n, stays in zip(points, count, inside, strict=True):
        assert mp_escape(chain, list(point), 8) == (n, stays)


def test_the_start_counts_as_the_design_says() -> None:
    bulb = catalog.load_chain("mandelbulb")
    points = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    assert [a.tolist() for a in escape(bulb, points, 9)] == [[9, 1], [True, False]]
    assert [a.tolist() for a in escape(bulb, points, 1)] == [[1, 1], [True, False]]
    julia = catalog.load_chain({"name": "mandelbulb", "julia": [0.1, 0.2, 0.3]})
    assert [a.tolist() for a in escape(julia, points, 9)] == [[9, 0], [True, False]]
    sponge = catalog.load_chain("menger_sponge")
    assert [a.tolist() for a in escape(sponge, points, 3)] == [[1, 0], [False, False]]


def test_a_point_that_leaves_at_the_limit_has_the_limit_as_count_and_is_outside() -> None:
    bulb = catalog.load_chain("mandelbulb")
    point = np.array([[1.3, 0.0, 0.0]])
    count, inside = escape(bulb, point, 50)
    assert not inside[0]
    at_limit = escape(bulb, point, int(count[0]))
    assert (int(at_limit[0][0]), bool(at_limit[1][0])) == (int(count[0]), False)
    assert bool(escape(bulb, point, int(count[0]) - 1)[1][0])


@pytest.mark.parametrize("name", catalog.names())
def test_extreme_points_give_no_nan_and_no_warning(name: str) -> None:
    chain = catalog.load_chain(name)
    values = (0.0, -0.0, 1e-300, 1.0, -1.0, 1e6, 1e150, 1e300)
    points = np.array([[x, y, z] for x in values for y in values for z in values])
    count, inside = escape(chain, points, 6)
    assert ((count >= 0) & (count <= 6)).all()
    far = np.abs(points).max(axis=1) > 1e4
    assert not inside[far].any()


def test_a_chain_takes_its_formulas_in_turn() -> None:
    bulb, box = catalog.load_chain("mandelbulb"), catalog.load_chain("mandelbox")
    both = catalog.load_chain(
        {"chain": [{"name": "mandelbulb", "count": 2}, {"name": "mandelbox"}], "bailout": 1e6}
    )
    point = [0.3, 0.2, -0.4]
    orbit = mp_orbit(both, point, 4)
    from clfractal.formulas.reference import MpmathBackend, apply

    names = [link.bound.formula.name for link in map(both.link_at, range(4))]
    assert names == ["mandelbulb", "mandelbulb", "mandelbox", "mandelbulb"]
    backend = MpmathBackend()
    state = orbit[0]
    for n, chain in enumerate((bulb, bulb, box, bulb)):
        state = tuple(apply(chain.first, state, point, backend))
        for got, expected in zip(orbit[n + 1], state, strict=True):
            assert float(got) == pytest.approx(float(expected), rel=1e-12)
