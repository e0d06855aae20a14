"""Ways to evaluate a tree agree, as OpenCL C too, and keep the conventions at awkward arguments."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import Phase, assume, given, settings

from clfractal.device.structs import Precision
from clfractal.errors import FormulaError, Where
from clfractal.formulas import catalog
from clfractal.formulas.backends import Dual, DualBackend, MpmathBackend, NumpyBackend, constant_dual, seeded
from clfractal.formulas.chain import Chain, single
from clfractal.formulas.evaluate import TINY, as_function, evaluate, evaluate_constant
from clfractal.formulas.language import Call, Name, Node, Number, parse
from clfractal.formulas.opencl import write_formula
from tests.devices import check_usable, device
from tests.formulas.opencl_batch import at_points, batch_text, formula_kernels
from tests.formulas.orbits import ORBITS
from tests.formulas.rounding import spread
from tests.formulas.trees import VARIABLES, any_tree, coordinates, tame_tree
from tests.small_kernels import Floats


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


# --- random expressions, written as OpenCL C ---


# Three trees make a formula; a formula is applied once to points of space.
FORMULAS = 16
POINTS = 64
# Faults of the past, and what random trees seldom have: bounds of a clamp that cross, nested powers, unlike branches,
# roots of negative numbers (which are 0) in conditions and in complex powers.
CHOSEN = (
    *("clamp(x, 1, y)", "clamp(y, x, -1)", "clamp(z, x, y)*clamp(x, -1, 0.5)"),
    *("log(x) + log(y*y)", "min(max(x, y, z), x*y, 0.3)**2", "cpow_re(x, y, -3) - cpow_im(x*y, z, 2.5)"),
    *(
        "where(x > y or not z < 0 and x != 1, sqrt(x)/y, y**-2)",
        "mod(x, y)*mod(z, 0.7)",
        "(x*x + 0.1)**(y*z)",
    ),
    *("x**3.5 - abs(y)**-0.5", "atan2(y, x)*atan2(x*x, -z)", "asin(x)*acos(y)/(1 + exp(-z))"),
    *("where(sqrt(x) == 0, y*z, z)", "where(sqrt(x) != 0, y*z, z)", "where(sqrt(x - y) > 0, z, x*z)"),
    *(
        "where(not (sqrt(y) == 0 or sqrt(z) <= 0), x*x, z)",
        "cpow_re(x, sqrt(y), 2)",
        "cpow_im(y, sqrt(z), 3)",
    ),
)
PLANES = ("real", "dual", "d/dx", "d/dy", "d/dz")
PRECISION: Precision = "float64"


@lru_cache
def random_trees() -> tuple[Node, ...]:
    """The first trees that hypothesis thinks of (always the same): built together, since a build costs seconds."""
    trees: list[Node] = []

    @settings(max_examples=3 * FORMULAS, phases=[Phase.generate], database=None)
    @given(tame_tree)
    def collect(tree: Node) -> None:
        trees.append(tree)

    collect()
    chosen = [parse(text, names=VARIABLES, where=Where()) for text in CHOSEN]
    return tuple([*chosen, *trees, *(Name("x") for _ in range(3 * FORMULAS))][: 3 * FORMULAS])


def chain_of(number: int) -> Chain:
    """A formula whose map are three trees; nothing is added, so that one application is the trees' values."""
    plain = catalog.load_chain(
        {
            "inline": {
                "title": "Random",
                "reference": "none",
                "variables": list(VARIABLES),
                "map": list(VARIABLES),
                "add": "none",
                "degree": 1,
                "bounds": {"center": [0, 0, 0], "radius": 3},
                "bailout": 4,
            }
        }
    ).first
    trees = random_trees()[3 * number : 3 * number + 3]
    return single(replace(plain, formula=replace(plain.formula, map=trees)))


def points() -> Floats:
    return np.random.default_rng(6).uniform(-3, 3, (POINTS, 3))


@lru_cache
def results(form: str) -> Floats:
    """Values and partials of every tree after one application, shape (trees, 5, points): real, then dual."""
    formulas = [
        write_formula(chain_of(n), dual_map="jacobian" if form == "jacobian" else "operations")
        for n in range(FORMULAS)
    ]
    text = "#define STEPS 1\n" + batch_text(formulas, ORBITS)
    kernels = formula_kernels(device(), text, PRECISION, 1)
    found = []
    for number, formula in enumerate(formulas):
        constants = np.array(formula.constants, PRECISION)
        counted = np.int32(chain_of(number).starts_counted)
        out = at_points(kernels, f"orbits_f{number}", points(), 2 * 16, counted, constants)
        found.append(out.reshape(2, 16, POINTS)[1, :15].reshape(3, 5, POINTS))
    return np.concatenate(found).astype(np.float64)


def duals(tree: Node, base: Any) -> Floats:
    """Value and partials, shape (4, points)."""
    names = dict(zip(VARIABLES, seeded(list(points().T)), strict=True))
    dual = constant_dual(evaluate(tree, names, DualBackend(base)), 3)
    return np.array([np.broadcast_to(v, POINTS) for v in (dual.value, *dual.partials)], np.float64)


def shown(node: Node) -> str:
    """A tree as text."""
    if isinstance(node, Call):
        return f"{node.function}({', '.join(map(shown, node.arguments))})"
    return node.name if isinstance(node, Name) else repr(node.value)


@pytest.mark.parametrize("form", ["operations", "jacobian"])
def test_random_expressions(form: str) -> None:
    check_usable(PRECISION)
    faults, compared = [], 0
    unit = float(np.finfo(PRECISION).eps)
    for tree, got in zip(random_trees(), results(form), strict=True):
        with np.errstate(all="ignore"):
            expected = duals(tree, NumpyBackend())
        width = spread(lambda noisy, tree=tree: duals(tree, noisy), 4 * unit)  # type: ignore[misc]
        # A point beside a jump of floor or of a condition has partials that differ, or values that do.
        width = np.where(width.max(axis=0) > 1e-6 * (1 + np.abs(expected).max(axis=0)), np.inf, width)
        allowed = 10 * width + 64 * unit * (np.abs(expected).max(axis=0) + 1e-3)
        usual = np.isfinite(allowed) & (np.abs(expected) < 1e100)
        compared += int(usual.sum())
        # rows 0: over real; 1 to 4: over dual
        for row, place in ((0, 0), (1, 0), (2, 1), (3, 2), (4, 3)):
            wrong = usual[place] & ~(np.abs(got[row] - expected[place]) <= allowed[place])
            if wrong.any():
                at = int(np.flatnonzero(wrong)[0])
                faults.append(
                    f"{PLANES[row]} at {points()[at].tolist()}: {got[row, at]!r}, "
                    f"NumPy {expected[place, at]!r}, allowed {allowed[place, at]:.2g}: {shown(tree)}"
                )
    assert compared > 0.5 * 4 * POINTS * len(random_trees())
    assert not faults, "\n".join([f"{len(faults)} faults", *sorted(faults, key=len)[:8]])
