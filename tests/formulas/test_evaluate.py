"""Three ways to evaluate a tree agree, and keep the conventions at awkward arguments."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given

from clfractal.errors import FormulaError, Where
from clfractal.formulas.backends import Dual, DualBackend, MpmathBackend, NumpyBackend, seeded
from clfractal.formulas.evaluate import TINY, as_function, evaluate, evaluate_constant
from clfractal.formulas.language import Call, Name, Node, Number, parse
from tests.formulas.trees import VARIABLES, any_tree, coordinates, tame_tree


def with_numpy(node: Node, point: tuple[float, ...]) -> float:
    with np.errstate(all="ignore"):
        names = {v: np.array([c]) for v, c in zip(VARIABLES, point, strict=True)}
        return float(np.ravel(evaluate(node, names, NumpyBackend()))[0])


def with_mpmath(node: Node, point: tuple[Any, ...]) -> Any:
    with mpmath.workdps(40):
        names = {v: mpmath.mpf(c) for v, c in zip(VARIABLES, point, strict=True)}
        return mpmath.mpf(evaluate(node, names, MpmathBackend()))


@given(tame_tree, coordinates, coordinates, coordinates)
def test_numpy_and_mpmath_agree_where_the_value_is_well_conditioned(
    node: Node, x: float, y: float, z: float
) -> None:
    exact = with_mpmath(node, (x, y, z))
    assume(mpmath.isfinite(exact) and abs(exact) < 1e12)
    # Where the 13th digit changes the result much, float64 has no right answer (or a step is near).
    for sign in (1, -1):
        nudged = with_mpmath(
            node, tuple(mpmath.mpf(c) * (1 + sign * 1e-13) + sign * 1e-14 for c in (x, y, z))
        )
        assume(mpmath.isfinite(nudged) and abs(nudged - exact) < 1e-9 * (1 + abs(exact)))
    assert with_numpy(node, (x, y, z)) == pytest.approx(float(exact), rel=1e-8, abs=1e-8)


@given(tame_tree, coordinates, coordinates, coordinates)
def test_python_floats_and_numpy_agree(node: Node, x: float, y: float, z: float) -> None:
    point = (x, y, z)
    value = float(evaluate(node, dict(zip(VARIABLES, point, strict=True))))
    other = with_numpy(node, point)
    assume(math.isfinite(value) and abs(value) < 1e12)
    names = {v: c + 1e-13 for v, c in zip(VARIABLES, point, strict=True)}
    assume(abs(float(evaluate(node, names)) - value) < 1e-9 * (1 + abs(value)))
    assert other == pytest.approx(value, rel=1e-8, abs=1e-8)


@given(any_tree | tame_tree, coordinates, coordinates, coordinates)
def test_a_function_made_of_a_tree_gives_the_same_bits(node: Node, x: float, y: float, z: float) -> None:
    names = dict(zip(VARIABLES, (x, y, z), strict=True))
    assert repr(as_function(node)(names)) == repr(evaluate(node, names))


_CONVENTIONS = [
    ("sqrt(x)", -2.0, 0.0),
    ("sign(x)", 0.0, 0.0),
    ("log(x)", 0.0, math.log(TINY)),
    ("log(x)", -3.0, math.log(TINY)),
    ("asin(x)", 1.5, math.pi / 2),
    ("acos(x)", -1.5, math.pi),
    ("atan2(x, x)", 0.0, 0.0),
    ("atan2(x, -1)", 0.0, math.pi),
    ("mod(x, 3)", -1.0, 2.0),
    ("mod(x, -3)", 1.0, -2.0),
    ("x**-2", 2.0, 0.25),
    ("x**3", -2.0, -8.0),
    ("x**0", 0.0, 1.0),
    ("x**2.5", -2.0, 0.0),
    ("x**2.5", 0.0, 0.0),
    ("x**-2.5", 0.0, math.inf),
    ("1/x", 0.0, math.inf),
    ("2**x", -1.0, 0.5),
    ("(-2)**x", 3.0, -8.0),
    ("(-2)**x", 2.5, 0.0),
    ("cpow_re(x, x, 3)", 0.0, 0.0),
    ("cpow_re(x, x, 2.5)", 0.0, 0.0),
    ("cpow_re(x, x, 0)", 0.0, 1.0),
    ("cpow_im(x, 2, 2)", 3.0, 12.0),
    ("cpow_re(x, 1, -1)", 1.0, 0.5),
    ("cpow_re(x, 0, 0.5)", 4.0, 2.0),
    ("where(x > 0, 1/x, 7)", 0.0, 7.0),
    ("where(x == 0, 7, 1/x)", 0.0, 7.0),
    ("clamp(x, 1, 2)", 5.0, 2.0),
    ("min(x, 3, 1)", 2.0, 1.0),
    ("where(not x > 1 and (x < 0 or x != 2), 1, 2)", 0.5, 1.0),
]


@pytest.mark.parametrize(("text", "x", "expected"), _CONVENTIONS)
def test_conventions_hold_in_every_reader(text: str, x: float, expected: float) -> None:
    node = parse(text, names=["x"], where=Where())
    close = pytest.approx(expected, rel=1e-15, abs=1e-300)
    assert float(evaluate(node, {"x": x})) == close
    assert with_numpy(node, (x, 0.0, 0.0)) == close
    assert float(with_mpmath(node, (x, 0.0, 0.0))) == close


@pytest.mark.parametrize(("text", "x", "expected"), _CONVENTIONS)
def test_duals_have_the_same_values_and_partials_that_are_numbers(
    text: str, x: float, expected: float
) -> None:
    node = parse(text, names=["x"], where=Where())
    with np.errstate(all="ignore"):
        result = evaluate(node, {"x": seeded([np.array([x])])[0]}, DualBackend(NumpyBackend()))
    value = result.value if isinstance(result, Dual) else result
    assert float(np.ravel(value)[0]) == pytest.approx(expected, rel=1e-15, abs=1e-300)
    if isinstance(result, Dual) and math.isfinite(expected):
        assert math.isfinite(float(np.ravel(result.partials[0])[0]))


@given(tame_tree, coordinates, coordinates, coordinates)
def test_duals_match_finite_differences(node: Node, x: float, y: float, z: float) -> None:
    point = (x, y, z)
    with mpmath.workdps(60):
        names = dict(zip(VARIABLES, seeded([mpmath.mpf(c) for c in point]), strict=True))
        result = evaluate(node, names, DualBackend(MpmathBackend()))
        if not isinstance(result, Dual):
            return
        assume(mpmath.isfinite(result.value) and abs(result.value) < 1e9)
        h = mpmath.mpf(10) ** -20
        for axis in range(3):
            step = [mpmath.mpf(c) + (h if i == axis else 0) for i, c in enumerate(point)]
            back = [mpmath.mpf(c) - (h if i == axis else 0) for i, c in enumerate(point)]
            up, down = (
                evaluate(node, dict(zip(VARIABLES, at, strict=True)), MpmathBackend()) for at in (step, back)
            )
            here = result.value
            forward, backward = (up - here) / h, (here - down) / h
            # At a kink or a step the two sides differ, and any one of them is right.
            assume(abs(forward - backward) < 1e-6 * (1 + abs(forward)))
            assume(abs(forward) < 1e9)
            assert float(result.partials[axis]) == pytest.approx(float(forward), rel=1e-5, abs=1e-5)


def test_constants_stay_python_floats() -> None:
    node = parse("x*(a + 1/3)", names=["x", "a"], where=Where())
    assert isinstance(node, Call)
    assert type(evaluate(node.arguments[1], {"a": 2.0, "x": np.zeros(2)}, NumpyBackend())) is float


def test_a_constant_must_be_finite() -> None:
    with pytest.raises(FormulaError, match="not a finite number"):
        evaluate_constant(Call("div", (Number(1.0), Name("a"))), {"a": 0.0})
    with pytest.raises(FormulaError, match="no value"):
        evaluate_constant(Name("b"), {"a": 0.0})
