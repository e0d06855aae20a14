"""The generated OpenCL of every formula against mpmath: values, Jacobians and scalar rules, in both precisions."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
import pytest

from clfractal.device.structs import Precision
from clfractal.formulas.backends import DualBackend, MpmathBackend, constant_dual, seeded
from clfractal.formulas.evaluate import evaluate
from clfractal.formulas.reference import apply, constant_of, mp_jacobian, mp_orbit
from tests.devices import usable
from tests.formulas.orbits import FAR, SPECS, STEPS, chain_of, orbit, points_of, start_at, texts
from tests.formulas.rounding import NoisyBackend, spread
from tests.small_kernels import Floats

Mask = np.ndarray[Any, np.dtype[np.bool_]]

PRECISIONS: tuple[Precision, ...] = ("float32", "float64")


# How many of them have no zero coordinate: there the derivative exists.
GENERAL = 10


@lru_cache
def exact(name: str) -> tuple[Floats, Floats]:
    """States (steps, size, n) and Jacobians (steps, size, 3, n) from mpmath, rounded to float64."""
    chain, first = chain_of(name), first_count(name)
    states, jacobians = [], []
    for point in points_of(chain):
        whole = mp_orbit(chain, list(point), STEPS + first, digits=30)
        states.append([[float(z) for z in state] for state in whole[first:]])
        jacobians.append(
            [
                [[float(p) for p in row] for row in mp_jacobian(chain, list(point), n + first, digits=30)]
                for n in (0, 1, STEPS)
            ]
        )
    return np.moveaxis(np.array(states), 0, -1), np.moveaxis(np.array(jacobians), 0, -1)


def first_count(name: str) -> int:
    return int("#define FIRST_COUNT 1" in texts("operations")[name].text)


@lru_cache
def tolerance(name: str, precision: Precision) -> tuple[Floats, Floats]:
    """What rounding alone may change of states and Jacobians, shapes as in `Orbit`."""
    chain, points = chain_of(name), points_of(chain_of(name))

    def disturbed(noisy: NoisyBackend) -> Floats:
        backend = DualBackend(noisy)
        state, point = start_at(chain, seeded(list(points.T)), backend)
        steps = []
        for n in range(STEPS + first_count(name) + 1):
            duals = [constant_dual(z, 3) for z in state]
            rows = [[np.broadcast_to(v, len(points)) for v in (d.value, *d.partials)] for d in duals]
            steps.append(np.array(rows))
            bound = chain.link_at(n).bound
            state = apply(bound, state, constant_of(bound, point), backend)
        return np.array(steps[first_count(name) :])

    unit = float(np.finfo(precision).eps)
    width = spread(disturbed, 2 * unit)
    with np.errstate(all="ignore"):
        size = disturbed(NoisyBackend(0.0, 0))
    # By norm: the ways to compute differ in how they cancel within a vector.
    width = np.broadcast_to(width.max(axis=1, keepdims=True), width.shape)
    scale = np.abs(size).max(axis=1, keepdims=True)
    allowed = 4 * width + 16 * unit * np.broadcast_to(scale, width.shape)
    return allowed[:, :, 0], allowed[:, :, 1:]


def compare(got: Floats, expected: Floats, allowed: Floats, states: Floats, what: str) -> None:
    """Asserts agreement at all steps until the orbit is far; the tolerances must be worth something, too."""
    radius = np.sqrt((states**2).sum(axis=1))
    near = np.logical_and.accumulate(radius <= FAR, axis=0)
    while near.ndim < got.ndim:
        near = near[:, None]
    near = np.broadcast_to(near, got.shape) & np.isfinite(allowed)
    assert near.mean() > 0.2, f"{what}: hardly anything was compared"
    with np.errstate(all="ignore"):
        ratio = np.where(near, np.abs(got - expected) / np.maximum(allowed, 1e-300), 0.0)
    ratio[near & np.isnan(got)] = np.inf
    worst = np.unravel_index(int(ratio.argmax()), ratio.shape)
    assert ratio.max() <= 1, (
        f"{what}{worst}: {got[worst]!r}, exact {expected[worst]!r}, allowed {allowed[worst]:.2g}"
    )


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", list(SPECS))
def test_values(name: str, precision: Precision) -> None:
    if not usable(precision):
        return
    states, _ = exact(name)
    allowed, _ = tolerance(name, precision)
    orbits = orbit(name, "operations", precision)
    compare(orbits.values, states, allowed, states, "value")
    for form in ("operations", "jacobian"):
        compare(orbit(name, form, precision).dual_values, states, allowed, states, form)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("form", ["operations", "jacobian"])
@pytest.mark.parametrize("name", list(SPECS))
def test_jacobians(name: str, form: str, precision: Precision) -> None:
    if not usable(precision):
        return
    states, jacobians = exact(name)
    _, allowed = tolerance(name, precision)
    taken = [0, 1, STEPS]
    got = orbit(name, form, precision).jacobian[taken][..., :GENERAL]
    compare(
        got, jacobians[..., :GENERAL], allowed[taken][..., :GENERAL], states[taken][..., :GENERAL], "partial"
    )


@pytest.mark.parametrize("name", list(SPECS))
def test_where_only_one_sided_derivatives_exist_they_are_finite(name: str) -> None:
    states, _ = exact(name)
    near = np.logical_and.accumulate(np.sqrt((states**2).sum(axis=1)) <= FAR, axis=0)
    for form in ("operations", "jacobian"):
        finite: Mask = np.isfinite(orbit(name, form, "float32").jacobian)
        assert finite[np.broadcast_to(near[:, None, None], finite.shape)].all()


def rule_orbit(name: str) -> Floats:
    """The scalar derivative after every step, shape (steps, n), with mpmath."""
    chain, backend = chain_of(name), MpmathBackend()
    first = first_count(name)
    found = []
    with mpmath.workdps(30):
        for point in points_of(chain):
            states = mp_orbit(chain, list(point), STEPS + first, digits=30)[first:]
            growth = [mpmath.mpf(1)]
            for n, state in enumerate(states[:-1]):
                bound = chain.link_at(n + first).bound
                assert bound.derivative is not None
                names: dict[str, Any] = {**bound.values, "dr": growth[-1]}
                names.update(zip(bound.formula.variables, state, strict=True))
                for let, node in bound.formula.let:
                    names[let] = evaluate(node, names, backend)
                growth.append(mpmath.mpf(evaluate(bound.derivative, names, backend)))
            found.append([float(g) for g in growth])
    return np.array(found).T


WITH_RULE = [name for name in SPECS if "derivative_apply_0" in texts("operations")[name].text]


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("name", WITH_RULE)
def test_scalar_rules(name: str, precision: Precision) -> None:
    if not usable(precision):
        return
    states, _ = exact(name)
    expected = rule_orbit(name)
    allowed, _ = tolerance(name, precision)
    # A rule is a product of functions of the states: their relative errors add up.
    size = np.abs(states).max(axis=1)
    with np.errstate(all="ignore"):
        relative = 40 * np.maximum.accumulate(np.nan_to_num(allowed.max(axis=1) / size, nan=0.0), axis=0)
    unit = float(np.finfo(precision).eps)
    got = orbit(name, "operations", precision).growth[:, None]
    compare(got, expected[:, None], ((relative + 64 * unit) * np.abs(expected))[:, None], states, "growth")


def test_most_library_formulas_have_a_rule_to_test() -> None:
    assert len(WITH_RULE) >= 10
