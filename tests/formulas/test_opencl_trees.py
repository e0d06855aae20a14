"""Random expressions, written as OpenCL C, agree with NumPy: values and, both ways, partials."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings

from clfractal.device.structs import Precision
from clfractal.errors import Where
from clfractal.formulas import catalog
from clfractal.formulas.backends import DualBackend, NumpyBackend, constant_dual, seeded
from clfractal.formulas.chain import Chain, single
from clfractal.formulas.evaluate import evaluate
from clfractal.formulas.language import parse
from clfractal.formulas.nodes import Call, Name, Node
from clfractal.formulas.opencl import write_formula
from tests.devices import device, usable
from tests.formulas.opencl_batch import at_points, batch_text, formula_kernels
from tests.formulas.orbits import ORBITS
from tests.formulas.rounding import spread
from tests.formulas.trees import VARIABLES, tame_tree
from tests.small_kernels import Floats

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
        out = at_points(kernels, f"orbits_f{number}", points(), 2 * 16, constants)
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
    if not usable(PRECISION):
        return
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
