"""Jets against derivatives by differences of sixty digits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from clfractal.formulas.backends import MpmathBackend
from clfractal.formulas.jets import Jet, JetBackend, constant_jet, full_bend, variable_jet
from clfractal.formulas.nodes import ARITHMETIC, COMPARISONS, FUNCTIONS, LOGIC

DIGITS = 90
STEP = 10.0**-20
"""Of differences: their errors are its square."""
NUMBERS: dict[str, int] = {**FUNCTIONS, **dict.fromkeys(ARITHMETIC, 2), "neg": 1}
POWERS = {"pow": (2, 3, -2, 2.5, 0.5, 1), "cpow_re": (1, 2, 3, -1, 2.5), "cpow_im": (1, 2, 3, -1, 2.5)}
_NEAR = st.floats(-1.5, 1.5).map(lambda value: round(value, 3))
# Neither 0 nor another one's, nor a whole multiple of it: there a value without a slope may still turn.
_VALUES = st.permutations((-1.27, -0.83, -0.31, 0.23, 0.59, 0.97, 1.41))
_SLOPES = st.lists(st.lists(_NEAR, min_size=9, max_size=9), min_size=3, max_size=3)


def quadratic(numbers: Sequence[float], point: Sequence[Any]) -> Any:
    """A value with slopes and bends at 0: a + b p + p C p / 2, of ten numbers."""
    terms = [mpmath.mpf(numbers[0]), *(b * p for b, p in zip(numbers[1:4], point, strict=True))]
    bend = full_bend(jet(numbers))
    terms += [bend[i, j] * point[i] * point[j] / 2 for i in range(3) for j in range(3)]
    return mpmath.fsum(terms)


def jet(numbers: Sequence[float]) -> Jet:
    return Jet(mpmath.mpf(numbers[0]), np.array(numbers[1:4]), np.array(numbers[4:]))


def differences(function: Any) -> tuple[Any, Any]:
    """First and second derivatives at 0 of a function of a point."""

    def at(*steps: tuple[int, int]) -> Any:
        point = [mpmath.mpf(0)] * 3
        for axis, sign in steps:
            point[axis] += sign * mpmath.mpf(STEP)
        return function(point)

    slope = [(at((i, 1)) - at((i, -1))) / (2 * STEP) for i in range(3)]
    bend = np.zeros((3, 3))
    for i in range(3):
        for j in range(i, 3):
            four = at((i, 1), (j, 1)) - at((i, 1), (j, -1)) - at((i, -1), (j, 1)) + at((i, -1), (j, -1))
            bend[i, j] = bend[j, i] = float(four / (4 * mpmath.mpf(STEP) ** 2))
    return np.array(list(map(float, slope))), bend


@pytest.mark.parametrize("function", sorted(set(NUMBERS) - {"where"}))
def test_every_function_has_its_derivatives(function: str) -> None:
    @settings(max_examples=12)
    @given(_VALUES, _SLOPES, st.integers(0, 5))
    def compare(values: list[float], slopes: list[list[float]], choice: int) -> None:
        numbers = [[value, *others] for value, others in zip(values[:3], slopes, strict=True)]
        count = NUMBERS[function]
        exponents = POWERS.get(function)
        fixed = [] if exponents is None else [exponents[choice % len(exponents)]]
        given = numbers[: count - len(fixed)]
        plain, jets = MpmathBackend(), JetBackend()
        with mpmath.workdps(DIGITS), np.errstate(all="ignore"):
            found = jets.call(function, [*map(jet, given), *fixed])
            # Beside what divides ways differences go both of them; far from it they have these digits.
            assume(jets.reach > 1e-3)
            slope, bend = differences(
                lambda point: plain.call(function, [*(quadratic(each, point) for each in given), *fixed])
            )
            exact = plain.call(function, [*(mpmath.mpf(each[0]) for each in given), *fixed])
        lifted = found if isinstance(found, Jet) else constant_jet(found)
        scale = 1 + float(np.abs(bend).max()) + float(np.abs(slope).max())
        assert lifted.value == exact
        np.testing.assert_allclose(lifted.slope, slope, rtol=1e-9, atol=1e-10 * scale)
        np.testing.assert_allclose(full_bend(lifted), bend, rtol=1e-9, atol=1e-10 * scale)

    compare()


@pytest.mark.parametrize("function", sorted(COMPARISONS))
def test_conditions_are_those_of_values_and_bound_the_reach(function: str) -> None:
    with mpmath.workdps(DIGITS):
        jets = JetBackend()
        a, b = variable_jet(mpmath.mpf("0.5"), 0), constant_jet(mpmath.mpf("0.25"))
        assert jets.call(function, [a, b]) is MpmathBackend().call(function, [a.value, b.value])
    assert jets.reach == pytest.approx(0.125)  # half of how far the other way lies


@pytest.mark.parametrize(
    ("function", "others", "edge"),
    [
        ("abs", [], 0.0),
        ("sign", [], 0.0),
        ("floor", [], 1.0),
        ("sqrt", [], 0.0),
        ("log", [], 0.0),
        ("asin", [], 1.0),
        ("acos", [], -1.0),
        ("min", [0.25], 0.25),
        ("max", [0.25], 0.25),
        ("clamp", [-0.75, 0.25], 0.25),
        ("mod", [0.5], 0.5),
        ("pow", [2.5], 0.0),
    ],
)
def test_where_ways_part_bounds_the_reach(function: str, others: list[float], edge: float) -> None:
    inner = 1e-30 * (1 if edge <= 0 else -1)
    with mpmath.workdps(DIGITS):
        jets = JetBackend()
        jets.call(function, [variable_jet(mpmath.mpf(edge) + mpmath.mpf(inner), 1), *others])
    assert jets.reach == pytest.approx(abs(inner) / 2, rel=1e-9)


def test_what_varies_nowhere_is_no_jet() -> None:
    with mpmath.workdps(DIGITS):
        assert not isinstance(JetBackend().call("add", [mpmath.mpf(1), mpmath.mpf(2)]), Jet)
        assert JetBackend().call("and", [True, False]) is False
    assert set(LOGIC) == {"and", "or", "not"}


def test_whole_powers_and_their_products_reach_everywhere() -> None:
    with mpmath.workdps(DIGITS):
        jets = JetBackend()
        x = variable_jet(mpmath.mpf("0.3"), 0)
        jets.call("pow", [x, 5])
        jets.call("cpow_re", [x, x, 8])
        jets.call("mul", [x, x])
    assert jets.reach == math.inf
