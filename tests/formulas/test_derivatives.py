"""Derivatives of every library formula: forward duals against finite differences in high precision."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

from clfractal.formulas import catalog
from clfractal.formulas.backends import Dual, DualBackend, NumpyBackend, constant_dual, seeded
from clfractal.formulas.chain import Chain
from clfractal.formulas.evaluate import evaluate
from clfractal.formulas.reference import apply, constant_of, mp_jacobian, mp_orbit, space_to_state

# Formulas whose map is a similarity of space in every point, so that one number is the whole derivative.
SIMILAR = [
    *("menger_sponge", "sierpinski_tetrahedron", "octahedral_ifs", "vicsek_cross"),
    *("kaleidoscopic_ifs", "polyhedral_ifs", "mandelbox", "twisted_box"),
]
QUATERNIONS = ["quaternion_julia", "quaternion_mandelbrot"]


def points_of(chain: Chain, count: int, seed: int = 4) -> np.ndarray[Any, np.dtype[np.float64]]:
    points = np.random.default_rng(seed).uniform(-1, 1, (count, 3)) * chain.radius * 0.7
    return np.round(points, 6)


@pytest.mark.parametrize("name", catalog.names())
def test_mpmath_duals_match_finite_differences(name: str) -> None:
    chain = catalog.load_chain(name)
    with mpmath.workdps(60):
        h = mpmath.mpf(10) ** -25
        for point in points_of(chain, 4):
            jacobian = mp_jacobian(chain, list(point), 3, digits=60)
            for axis in range(3):
                ahead, behind = (
                    mp_orbit(
                        chain, [c + (step if i == axis else 0) for i, c in enumerate(point)], 3, digits=60
                    )
                    for step in (h, -h)
                )
                for row, (a, b) in enumerate(zip(ahead[-1], behind[-1], strict=True)):
                    difference = float((a - b) / (2 * h))
                    assert float(jacobian[row][axis]) == pytest.approx(difference, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("name", catalog.names())
def test_numpy_duals_match_mpmath_duals(name: str) -> None:
    chain = catalog.load_chain(name)
    points = points_of(chain, 20)
    backend = DualBackend(NumpyBackend())
    c = space_to_state(chain, seeded(list(points.T)), backend)
    state: list[Any] = [np.zeros(len(points))] * chain.size if chain.add == "point" else c
    with np.errstate(all="ignore"):
        for application in range(3):
            bound = chain.link_at(application).bound
            state = apply(bound, state, constant_of(bound, c), backend)
    for index, point in enumerate(points):
        exact = mp_jacobian(chain, list(point), 3)
        scale = max(1.0, *(abs(float(value)) for row in exact for value in row))
        for got, row in zip(state, exact, strict=True):
            partials = constant_dual(got, 3).partials
            for value, expected in zip(partials, row, strict=True):
                number = float(np.broadcast_to(value, len(points))[index])
                assert number == pytest.approx(float(expected), abs=1e-9 * scale)


def jacobian_and_rule(name: str, count: int = 12) -> list[tuple[Any, float]]:
    """Jacobians of the map alone by the state, and the scalar rule with dr = 1 and nothing added."""
    bound = catalog.load_chain(name).first
    formula = bound.formula
    size = len(formula.variables)
    states = np.random.default_rng(8).uniform(-2, 2, (count, size))
    found = []
    for state in states:
        names: dict[str, Any] = {**bound.values}
        names.update(zip(formula.variables, seeded([np.array([c]) for c in state]), strict=True))
        backend = DualBackend(NumpyBackend())
        with np.errstate(all="ignore"):
            for let, node in formula.let:
                names[let] = evaluate(node, names, backend)
            rows = [constant_dual(evaluate(node, names, backend), size).partials for node in formula.map]
            names.update(dr=1.0, added=0.0)
            assert formula.derivative is not None
            rule = evaluate(formula.derivative, names, backend)
        jacobian = np.array([[float(np.ravel(value)[0]) for value in row] for row in rows])
        value = rule.value if isinstance(rule, Dual) else rule
        found.append((jacobian, float(np.ravel(value)[0])))
    return found


@pytest.mark.parametrize("name", SIMILAR)
def test_the_scalar_rule_is_the_jacobian_where_the_map_is_a_similarity(name: str) -> None:
    for jacobian, rule in jacobian_and_rule(name):
        np.testing.assert_allclose(jacobian.T @ jacobian, rule**2 * np.eye(3), atol=1e-9 * rule**2)


@pytest.mark.parametrize("name", QUATERNIONS)
def test_the_scalar_rule_bounds_the_jacobian_of_quaternion_powers(name: str) -> None:
    for jacobian, rule in jacobian_and_rule(name):
        assert np.linalg.norm(jacobian, ord=2) == pytest.approx(rule, rel=1e-9)


@pytest.mark.parametrize("power", [2, 3, 8, 2.5])
def test_the_mandelbulb_rule_is_the_derivative_along_the_axis(power: float) -> None:
    # On the polar axis the map is z -> z**power, so dz/dC follows n z**(n - 1) dz/dC + 1 exactly.
    chain = catalog.load_chain("mandelbulb", {"power": power})
    rule = chain.first.derivative
    assert rule is not None
    z, dr = 0.83, 1.0
    for applications in (2, 3, 4):
        dr = float(evaluate(rule, {**chain.first.values, "x": 0.0, "y": 0.0, "z": z, "dr": dr}))
        z = z**power + 0.83
        assert float(mp_jacobian(chain, [0, 0, 0.83], applications)[2][2]) == pytest.approx(dr, rel=1e-12)


def test_a_julia_set_adds_nothing_to_the_derivative() -> None:
    julia = catalog.load_chain({"name": "mandelbulb", "julia": [0.1, 0.2, 0.3]}).first
    point = catalog.load_chain("mandelbulb").first
    names = {**point.values, "x": 0.0, "y": 0.0, "z": 0.5, "dr": 3.0}
    assert julia.derivative is not None
    assert point.derivative is not None
    assert float(evaluate(point.derivative, names)) - float(evaluate(julia.derivative, names)) == 1.0
