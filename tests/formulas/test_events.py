"""Orbits that are followed operation by operation: folds through a place, and every operation of the language."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from clfractal.formulas import catalog, events
from clfractal.formulas.chain import Chain
from clfractal.formulas.deep import steps_per_pixel, way_of
from clfractal.formulas.deep_table import table_of
from clfractal.formulas.opencl import forget_texts
from clfractal.formulas.place import Place
from clfractal.formulas.reference import mp_escape
from clfractal.integrators.points import distances, escape
from tests.devices import check_usable, device

NEAR = (0.6273456789, 0.4134567891, 0.3334567891)
# Of every operation, by formulas that have it.
FORMULAS: Mapping[str, Mapping[str, Any]] = {
    "hast": {},  # roots, divisions, where
    "mandelbulb": {"power": 2.5},  # powers, angles
    "cosine_mandelbulb": {},
    "mandelbox": {},
    "kaliset": {},
    "menger_sponge": {},
}


def placed(
    name: str, center: tuple[str, str, str], magnification: float, iterations: int, **parameters: Any
) -> Chain:
    chain = catalog.load_chain(name, parameters or None)
    return replace(chain, place=Place(center, magnification, iterations))


@pytest.fixture
def nothing_is_straight(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """All applications that may be events are."""

    def nowhere(chain: Chain, orbit: Any, begin: int, off: float, reach: float) -> tuple[int, Any]:
        width = len(orbit.states[begin])
        return begin, np.hstack([off * np.eye(width), np.zeros((width, 3))])

    monkeypatch.setattr(events, "_straight_way", nowhere)
    monkeypatch.setattr(events, "WIDE", 2.0**-21)
    monkeypatch.setattr("clfractal.formulas.deep.WIDE", 2.0**-21)
    monkeypatch.setattr("clfractal.formulas.deep._straight", lambda state, size: 0.0)
    _forget()
    yield
    _forget()


def _forget() -> None:
    from clfractal.formulas import deep

    deep._found_orbit.cache_clear()
    deep._way_of.cache_clear()
    forget_texts()


@pytest.mark.parametrize("name", FORMULAS)
@pytest.mark.usefixtures("nothing_is_straight")
def test_every_operation_beside_a_place(name: str) -> None:
    """Distances of points around a place are those of the formula without one."""
    check_usable("float64")
    # So small a picture that many applications are events, and one that float64 resolves without a place.
    magnification, iterations = 1e9, 12
    chain = placed(name, tuple(map(repr, NEAR)), magnification, iterations, **FORMULAS[name])  # type: ignore[arg-type]
    assert way_of(chain, chain.place.scale).events  # type: ignore[union-attr]
    points = np.random.default_rng(5).uniform(-1, 1, (256, 3))
    lanes = 8
    found = distances(chain, points, iterations, device=device(), lanes=lanes, precision="float64")
    plain = replace(chain, place=None)
    exact = distances(
        plain,
        np.array(NEAR) + points / magnification,
        iterations,
        device=device(),
        lanes=lanes,
        precision="float64",
    )
    assert (found.inside == exact.inside).all()
    outside = ~exact.inside
    np.testing.assert_allclose(found.full[outside], exact.full[outside] * magnification, rtol=1e-5)
    # (Of powers rays march by the Jacobian there.)
    step = exact.step if chain.degree <= 1 else exact.full
    np.testing.assert_allclose(found.step[outside], step[outside] * magnification, rtol=1e-5)
    np.testing.assert_allclose(found.smooth[outside], exact.smooth[outside], atol=1e-5)


@pytest.mark.parametrize(("magnification", "iterations"), [(1e13, 36), (1e16, 42)])
def test_folds_through_the_corner_of_a_sponge(magnification: float, iterations: int) -> None:
    """Counts around a corner, through which every fold passes: those of mpmath, where float64 alone has none."""
    check_usable("float64")
    chain = placed("menger_sponge", ("1", "1", "1"), magnification, iterations)
    assert steps_per_pixel(chain) > 16
    points = np.random.default_rng(3).uniform(-1, 1, (60, 3))
    count, _ = escape(chain, points, iterations, device=device(), lanes=8, precision="float64")
    digits = 40 + int(np.log10(magnification))
    exact = np.array([mp_escape(chain, point, iterations, digits)[0] for point in points])
    assert len(set(exact.tolist())) > 5
    assert (count == exact).mean() >= 0.98  # (a tie may go either way)


def test_tables_fit_in_the_memory_for_constants() -> None:
    chain = placed("menger_sponge", ("1", "1", "1"), 1e60, 140)
    assert way_of(chain, 1e-60).events
    assert len(table_of(chain)) * 8 < 61_000


def test_a_cycle_that_attracts_has_no_events() -> None:
    """Around the middle of a bulb space shrinks: no way leads to where orbits part."""
    chain = placed("quaternion_mandelbrot", ("-1", "0", "0"), 1e12, 100)
    assert not way_of(chain, 1e-12).events
