"""The OpenCL of parameters against NumPy and mpmath: one program for all values, and right for each of them."""

from __future__ import annotations

from functools import lru_cache, partial
from itertools import product
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.formulas import catalog
from clfractal.formulas.backends import DualBackend, NumpyBackend, constant_dual, seeded
from clfractal.formulas.chain import Chain
from clfractal.formulas.language import Parameter
from clfractal.formulas.opencl import FormulaText, write_formula
from clfractal.formulas.reference import apply, constant_of, mp_orbit
from tests.devices import device, usable
from tests.formulas.opencl_batch import at_points, batch_text, formula_kernels
from tests.formulas.orbits import FAR, ORBITS, STEPS, points_of, start_at
from tests.formulas.rounding import spread
from tests.small_kernels import Floats, SmallKernels
from tests.variants import one_of

SINGLE = [name for name in catalog.names() if not catalog.is_chain(name)]
LIVE = [name for name in SINGLE if catalog.load(name).parameters]
# Every use that an exponent, a condition or a divisor may have; values are those of one application.
INLINE: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "parameters": {"p": {"default": 2, "minimum": -6, "maximum": 6}, "q": 0.5},
    "map": [
        "x**p + cpow_im(x, y, p)*q",
        "cpow_re(y, z, -p) + where(p > 1, y**2, q*y) + where(mod(p, 2) == 0, z**p, abs(z)**p)",
        "where(q != 0 and x > 0, z/where(q == 0, 1, q), z - q) + where(p >= 0, (x*x + y*y)**p, 1)",
    ],
    "add": "none",
    "degree": 1,
    "bounds": {"radius": 2},
}
# Where the power is 0 or below at the origin.
AT = np.array([[0, 0, 0], [0, 0, 0.5], [-0.5, 0, 0], [0, -0.75, 0.5], [-0.5, -0.25, -1.5], [1.5, 0.25, 0.5]])
VALUES: dict[str, list[dict[str, float]]] = {
    "mandelbulb": [
        {"power": power, "theta_phase": theta, "phi_phase": phi}
        for power, theta, phi in ((2, 0, 0), (3, 0.5, 1), (8, 1, 0), (2.5, 0, 0.25), (7.75, 1, 1), (17, 0, 0))
    ],
    "hast": [{"power": power} for power in (2, 4, 8)],
    "mandelbox": [
        {"scale": scale, "min_radius": low, "fixed_radius": high}
        for scale, low, high in ((2, 0.5, 1), (-1.5, 1, 1), (3, 0.25, 2))
    ],
    "polyhedral_ifs": [
        {"order": order, "edge": edge, "vertex": 1 - edge} for order, edge in ((3, 0), (5, 1))
    ],
}


def values_of(name: str) -> list[dict[str, float]]:
    """Values that are tried: those above, else both ends of all ranges, the defaults, and 0 and 1."""
    if name in VALUES:
        return VALUES[name]
    found = catalog.load(name).parameters
    rows = [{p.name: p.default for p in found}]
    for wanted in (0.0, 1.0, 3.0):
        rows.append({p.name: nearest(p, wanted) for p in found})
    return rows


def nearest(parameter: Parameter, wanted: float) -> float:
    """The value nearest to the wanted one that a parameter may have."""
    if parameter.choices is not None:
        return min(parameter.choices, key=lambda choice: abs(choice - wanted))
    low = parameter.minimum if parameter.minimum is not None else 0.0
    high = parameter.maximum if parameter.maximum is not None else wanted
    return min(max(wanted, low), high)


def spec_of(name: str, parameters: dict[str, float]) -> dict[str, Any]:
    return {**({"inline": INLINE} if name == "inline" else {"name": name}), "parameters": parameters}


@lru_cache
def texts() -> list[FormulaText]:
    return [write_formula(catalog.load_chain(spec_of(name, {}))) for name in (*LIVE, "inline")]


@lru_cache
def kernels(precision: Precision) -> SmallKernels:
    lanes = accepted_lanes(device(), precision)
    chosen = lanes[min(1, len(lanes) - 1)]
    text = f"#define STEPS {STEPS}\n" + batch_text(texts(), ORBITS)
    return formula_kernels(device(), text, precision, chosen)


def orbits(
    name: str, parameters: dict[str, float], at: Floats, precision: Precision, *, as_any: bool = False
) -> Floats:
    """Shape (steps, size, 5, n): values over real, then value and partials over dual, of the one program.

    `as_any`: usual values are computed as any others are.
    """
    number = (*LIVE, "inline").index(name)
    chain = catalog.load_chain(spec_of(name, parameters))
    formula = write_formula(chain)
    assert formula.text is texts()[number].text
    with np.errstate(over="ignore"):
        constants = np.array(formula.constants, precision)
    if as_any and any(link.bound.formula.shaping for link in chain.links):
        assert constants[0] in (0, 1)
        constants[0] = 0
    planes = (STEPS + 1) * (5 * chain.size + 1)
    out = at_points(kernels(precision), f"orbits_f{number}", at, planes, constants)
    each = out.reshape(STEPS + 1, 5 * chain.size + 1, len(at)).astype(np.float64)
    return each[:, :-1].reshape(STEPS + 1, chain.size, 5, len(at))


def oracle(chain: Chain, at: Floats, base: Any, steps: int = STEPS) -> Floats:
    """States and partials after each application, shape (steps, size, 4, n), by the plain formula."""
    backend = DualBackend(base)
    state, point = start_at(chain, seeded(list(at.T)), backend)
    found = []
    # With the constant inside its map, iteration starts at 0.
    first = int(chain.add == "point" and chain.first.start is not None)
    for n in range(steps + first + 1):
        duals = [constant_dual(z, 3) for z in state]
        rows = [[np.broadcast_to(v, len(at)) for v in (d.value, *d.partials)] for d in duals]
        found.append(np.array(rows, dtype=float))
        if n < steps + first:
            bound = chain.link_at(n).bound
            state = apply(bound, state, constant_of(bound, point), backend)
    return np.array(found[first:])


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("name", LIVE)
def test_every_value_of_the_library(name: str, precision: Precision) -> None:
    if not usable(precision):
        return
    unit = float(np.finfo(precision).eps)
    compared = 0
    for parameters, as_any in product(({}, *values_of(name)), (False, True)):
        chain = catalog.load_chain(spec_of(name, parameters))
        at = points_of(chain)[:10]
        with np.errstate(all="ignore"):
            expected = oracle(chain, at, NumpyBackend())
        # An angle times the power: its rounding is the power's multiple of one number's.
        width = spread(partial(oracle, chain, at), 8 * unit)
        width = np.broadcast_to(width.max(axis=1, keepdims=True), width.shape)
        scale = np.abs(expected).max(axis=1, keepdims=True)
        allowed = 8 * width + 64 * chain.first.degree * unit * scale
        got = orbits(name, parameters, at, precision, as_any=as_any)
        radius = np.sqrt((expected[:, :, 0] ** 2).sum(axis=1))
        near = np.logical_and.accumulate(radius <= FAR, axis=0)[:, None, None]
        near = np.broadcast_to(near, expected.shape) & np.isfinite(allowed)
        for rows in (got[:, :, 1:], got[:, :, [0, 2, 3, 4]]):
            wrong = near & ~(np.abs(rows - expected) <= allowed)
            assert not wrong.any(), (parameters, np.argwhere(wrong)[0], rows[wrong][0], expected[wrong][0])
        compared += int(near.sum())
    assert compared > 100


@pytest.mark.parametrize("power", [2, 5, 2.5, 8.0])
def test_a_mandelbulb_against_forty_digits(power: float) -> None:
    if not usable("float64"):
        return
    chain = catalog.load_chain(spec_of("mandelbulb", {"power": power}))
    at = points_of(chain)[:13]
    got = orbits("mandelbulb", {"power": power}, at, "float64")[:, :, 0]
    for index, point in enumerate(at.tolist()):
        with mpmath.workdps(40):
            states = [[float(z) for z in state] for state in mp_orbit(chain, point, STEPS + 1)[1:]]
        for step, state in enumerate(states):
            size = max(1.0, float(np.linalg.norm(state)))
            if size > FAR:
                break
            assert np.abs(got[step, :, index] - state).max() <= 1e-13 * (2 * power) ** step * size


exponents = st.integers(-6, 6).map(float) | st.sampled_from([0.5, -0.5, 1.5, 2.5]) | st.floats(-6, 6)
factors = st.sampled_from([0.0, 1.0, -1.0, 0.5]) | st.floats(-2, 2).map(lambda v: round(v, 3))


@given(p=exponents, q=factors)
@settings(max_examples=60, deadline=None)
def test_any_exponent(p: float, q: float) -> None:
    if not usable("float64"):
        return
    parameters = {"p": round(p, 6), "q": q}
    chain = catalog.load_chain(spec_of("inline", parameters))
    with np.errstate(all="ignore"):
        expected = oracle(chain, AT, NumpyBackend(), 1)[1]
        width = spread(partial(oracle, chain, AT, steps=1), 1e-14)[1]
    got = orbits("inline", parameters, AT, "float64")[1]
    # Values are total: whatever x and y are, they are what the conventions say.
    for row in (0, 1):
        value, other = got[:, row], expected[:, 0]
        allowed = 10 * np.nan_to_num(width[:, 0], nan=0, posinf=0) + 1e-12 * (1 + np.abs(other))
        with np.errstate(invalid="ignore"):
            good = (value == other) | (np.abs(value - other) <= allowed) | (np.isnan(value) & np.isnan(other))
        assert good.all(), (row, AT[~good.all(axis=0)], value[~good], other[~good])
    # Partials where no coordinate is 0.
    some = expected[:, 1:, 4:]
    allowed = 10 * width[:, 1:, 4:] + 1e-11 * (1 + np.abs(some))
    assert (np.abs(got[:, 2:, 4:] - some) <= allowed).all()
