"""Formulas from mappings, parameters, binding and chains: what is allowed, errors, and all values in one program."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.device.structs import Precision
from clfractal.device.tune import accepted_lanes
from clfractal.errors import FormulaError, Where
from clfractal.formulas import catalog
from clfractal.formulas.backends import DualBackend, NumpyBackend, constant_dual, seeded
from clfractal.formulas.chain import Chain
from clfractal.formulas.language import BoundFormula, Parameter, bind, formula_from_mapping, to_text
from clfractal.formulas.opencl import FormulaText, write_formula
from clfractal.formulas.reference import apply, constant_of, mp_orbit
from tests.calls import failure
from tests.devices import check_usable, device
from tests.formulas.opencl_batch import at_points, batch_text, formula_kernels
from tests.formulas.orbits import FAR, ORBITS, STEPS, points_of, start_at
from tests.formulas.rounding import spread
from tests.small_kernels import Floats, SmallKernels
from tests.variants import every, one_of

PLAIN: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "parameters": {
        "power": {"type": "int", "default": 2, "choices": [2, 4, 8]},
        "bend": {"default": 0.5, "minimum": 0, "maximum": 2},
        "plain": 1.5,
    },
    "let": {"r": "sqrt(x*x + y*y)", "s": "where(r > 0, 1/r, 1)"},
    "map": ["x*s", "y*bend", "z + plain"],
    "repeat": "log2(power)",
    "degree": "power",
    "bounds": {"center": [0, "bend", 0], "radius": "2 + plain"},
    "bailout": "4*bend",
}


def formula(**changes: Any) -> Any:
    data = {**copy.deepcopy(PLAIN), **changes}
    return formula_from_mapping(
        {k: v for k, v in data.items() if v is not ...}, Where(path="formula"), name="f"
    )


def bound(parameters: dict[str, Any] | None = None, **more: Any) -> BoundFormula:
    return bind(formula(), parameters, where=Where(path="formula"), **more)


def refused(call: Callable[[], object], path: str, words: str) -> None:
    """With one line that says where."""
    error = failure(FormulaError, call)
    assert words in error.message
    assert error.where.path == path


def test_numbers_follow_from_parameters() -> None:
    f = bound({"power": 8, "bend": 1})
    assert (f.repeat, f.degree, f.bailout, f.center, f.radius) == (3, 8.0, 4.0, (0.0, 1.0, 0.0), 3.5)
    assert f.values == {"power": 8.0, "bend": 1.0, "plain": 1.5}
    assert f.step_scale == 0.75  # no rule for the derivative
    assert bound().bailout == 2.0
    assert bound(bailout=7).bailout == 7.0


def test_the_distance_bailout_leaves_room_for_float32() -> None:
    for power in (2, 4, 8):
        f = bound({"power": power})
        assert f.bailout <= f.distance_bailout <= 1000
        assert f.distance_bailout**f.degree <= 1e8 * 1.001
    assert bound({"power": 2}).distance_bailout == 1000.0
    assert bound({"power": 8}, distance_bailout=5).distance_bailout == 5.0
    assert bound({"power": 8}, distance_bailout=1).distance_bailout == 2.0  # never below the bailout


@pytest.mark.parametrize(
    ("changes", "path", "words"),
    [
        ({"colour": 1}, "formula", "unknown key 'colour'"),
        ({"bailut": 1}, "formula", "did you mean 'bailout'?"),
        ({"map": ...}, "formula", "lacks the key 'map'"),
        ({"bounds": ...}, "formula", "lacks the key 'bounds'"),
        ({"variables": ["x", "y"]}, "formula.variables", "three or four names"),
        ({"variables": ["x", "y", "y"]}, "formula.variables.2", "used twice"),
        ({"variables": ["x", "y", "lambda"]}, "formula.variables.2", "is reserved"),
        ({"variables": ["x", "y", "sin"]}, "formula.variables.2", "is reserved"),
        ({"variables": ["x", "y", "dr"]}, "formula.variables.2", "is reserved"),
        ({"variables": ["x", "y", "2z"]}, "formula.variables.2", "a name is a letter"),
        ({"variables": ["x", "y", "z" * 41]}, "formula.variables.2", "a name is a letter"),
        ({"map": ["x", "y"]}, "formula.map", "3 expressions, one for each variable, got 2"),
        ({"map": ["x", "y", "z", "x"]}, "formula.map", "got 4"),
        ({"map": "x"}, "formula.map", "got no list"),
        ({"map": ["x", "y", "q"]}, "formula.map.2", "unknown name 'q'"),
        ({"map": ["x", "y", "dr"]}, "formula.map.2", "unknown name 'dr'"),
        ({"map": ["x", "y", True]}, "formula.map.2", "got true"),
        ({"map": ["x", "y", "cpow_re(x, y, z)"]}, "formula.map.2", "must be constant, but uses 'z'"),
        ({"let": {"r": "x", "s": "r + s"}}, "formula.let.s", "'s' uses itself"),
        ({"let": {"r": "s", "s": "x"}}, "formula.let.r", "'r' uses 's', which is defined after it"),
        ({"let": {"x": "1"}}, "formula.let.x", "used twice"),
        ({"let": ["x"]}, "formula.let", "must be a mapping"),
        ({"let": {"r": "x", "s": "cpow_im(x, y, r)"}}, "formula.let.s", "must be constant, but uses 'r'"),
        ({"parameters": {"x": 1}}, "formula.parameters.x", "used twice"),
        ({"parameters": {"p": {"type": "whole"}}}, "formula.parameters.p.type", "unknown type"),
        ({"parameters": {"p": {"type": "int"}}}, "formula.parameters.p", "lacks the key 'default'"),
        ({"parameters": {"p": {"type": "int", "default": 1.5}}}, "formula.parameters.p.default", "whole"),
        ({"parameters": {"p": {"default": 3, "maximum": 2}}}, "formula.parameters.p.default", "at most 2"),
        ({"parameters": {"p": {"default": 3, "choices": []}}}, "formula.parameters.p.choices", "a list"),
        ({"parameters": {"p": {"default": 3, "baked": 1}}}, "formula.parameters.p.baked", "true or false"),
        ({"parameters": {"p": {"defalt": 3}}}, "formula.parameters.p", "did you mean 'default'?"),
        ({"repeat": "x"}, "formula.repeat", "unknown name 'x'"),
        ({"bounds": {"radius": "power", "centre": [0, 0, 0]}}, "formula.bounds", "did you mean 'center'?"),
        ({"bounds": {"radius": 1, "center": [0, 0]}}, "formula.bounds.center", "three numbers"),
        ({"bounds": {"center": [0, 0, 0]}}, "formula.bounds", "lacks the key 'radius'"),
        ({"bounds": 2}, "formula.bounds", "must be a mapping"),
        ({"add": "points"}, "formula.add", "did you mean 'point'?"),
        ({"slice": {"w": 0}}, "formula.slice", "only a formula of four variables"),
        ({"julia": [0, 0, 0]}, "formula.julia", "only a formula with `add: constant`"),
        ({"add": "constant", "julia": [0, 0]}, "formula.julia", "must have 3 numbers"),
        ({"derivative": "2*q"}, "formula.derivative", "unknown name 'q'"),
        ({"title": 3}, "formula.title", "must be text"),
    ],
)
def test_a_wrong_formula_is_one_located_error(changes: dict[str, Any], path: str, words: str) -> None:
    refused(lambda: formula(**changes), path, words)


@pytest.mark.parametrize("data", [None, 3, "x", [], ["variables"]])
def test_a_formula_is_a_mapping(data: object) -> None:
    with pytest.raises(FormulaError, match="must be a mapping"):
        formula_from_mapping(data, name="f")


@pytest.mark.parametrize(
    ("parameters", "path", "words"),
    [
        ({"pwer": 2}, "formula.parameters.pwer", "unknown parameter 'pwer'; did you mean 'power'?"),
        ({"power": 3}, "formula.parameters.power", "must be one of 2, 4, 8, got 3"),
        ({"power": 2.5}, "formula.parameters.power", "must be a whole number, got 2.5"),
        ({"bend": 3}, "formula.parameters.bend", "must be at most 2, got 3"),
        ({"bend": -1}, "formula.parameters.bend", "must be at least 0, got -1"),
        ({"bend": True}, "formula.parameters.bend", "must be a number, got 'True'"),
        ({"bend": "1"}, "formula.parameters.bend", "must be a number, got '1'"),
        ({"bend": float("nan")}, "formula.parameters.bend", "finite"),
        ({"bend": 10**400}, "formula.parameters.bend", "finite"),
        ({"bend": 0}, "formula", "bailout must be above 0"),
    ],
)
def test_a_wrong_parameter_is_one_located_error(parameters: dict[str, Any], path: str, words: str) -> None:
    refused(lambda: bound(parameters), path, words)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"repeat": "power/8"}, "repeat must be 1 to 64"),
        ({"repeat": "power + 0.5"}, "repeat must be a whole number, got 2.5"),
        ({"repeat": "log(0*power)"}, "repeat must be 1 to 64"),
        ({"degree": "power/4"}, "degree must be 1 to 1000"),
        ({"bailout": "1/(power - 2)"}, "bailout is not a finite number with power = 2"),
        ({"step_scale": 0}, "step_scale must be above 0"),
        ({"bounds": {"radius": "power - 2"}}, "bounds.radius must be above 0"),
        ({"bounds": {"radius": 1, "center": ["1e9", 0, 0]}}, "bounds.center must lie within"),
        ({"map": ["x/(power - 2)", "y", "z"]}, "division by zero in 'x'"),
        ({"map": ["x**(power*1000)", "y", "z"]}, "an exponent in 'x' must be at most 1000"),
        ({"derivative": "dr", "repeat": 2}, "cannot repeat its map"),
    ],
)
def test_parameters_that_give_no_meaning_are_refused(changes: dict[str, Any], words: str) -> None:
    assert words in failure(FormulaError, lambda: bind(formula(**changes))).message


def test_a_division_guarded_by_where_is_allowed() -> None:
    bind(formula(map=["where(power > 2, x/(power - 2), x)", "y", "z"]))


def test_a_julia_constant_replaces_the_point() -> None:
    f = bound(julia=[0.1, 0.2, 0.3])
    assert (f.add, f.julia) == ("constant", (0.1, 0.2, 0.3))
    assert f.center == (0.0, 0.0, 0.0)
    for wrong in ([0.1, 0.2], "abc", [0, 0, None], [0, 0, 1e9], [0, 0, float("nan")]):
        assert (failure(FormulaError, bound, julia=wrong).where.path or "").startswith("formula.julia")
    with pytest.raises(FormulaError, match="no Julia sets"):
        bind(catalog.load("menger_sponge"), julia=[0, 0, 0])
    with pytest.raises(FormulaError, match="needs a julia constant of 3 numbers"):
        bind(formula(add="constant"))


def test_where_iteration_starts() -> None:
    assert bind(catalog.load("hast"), {"power": 8}).start == (0.0, 0.0, 0.0)
    shifted = formula(map=["x + 1", "2*y", "z - 3"], repeat=2)
    assert bind(shifted).start == (2.0, 0.0, -6.0)
    assert bind(formula(map=["1/x", "y", "z"])).start is None
    uses_point = formula(map=["x*point_x", "y", "z"])
    assert uses_point.point_map
    assert bind(uses_point).start is None


def test_expressions_print_as_they_were() -> None:
    f = formula()
    assert to_text(f.map[1]) == "(y * bend)"
    assert [name for name, _ in f.let] == ["r", "s"]
    assert f.source == PLAIN


def test_chains() -> None:
    chain = catalog.resolve(
        {
            "chain": [
                {"name": "mandelbox", "count": 2, "parameters": {"scale": 3}},
                {"name": "mandelbulb", "parameters": {"power": 4}},
            ]
        }
    )
    assert [chain.link_at(n).bound.formula.name for n in range(5)] == [
        *("mandelbox", "mandelbox", "mandelbulb"),
        *("mandelbox", "mandelbox"),
    ]
    assert (chain.cycle_length, chain.size) == (3, 3)
    assert chain.degree == pytest.approx(4)
    box, bulb = (link.bound for link in chain.links)
    assert chain.bailout == max(box.bailout, bulb.bailout)
    assert chain.radius >= max(box.radius, bulb.radius)
    assert chain.step_scale == min(box.step_scale, bulb.step_scale)
    assert chain.distance_bailout >= chain.bailout


@pytest.mark.parametrize(
    ("spec", "path", "words"),
    [
        ({"name": "mandelbulp"}, "formula.name", "unknown formula 'mandelbulp'; did you mean 'mandelbulb'?"),
        ({"name": "hast", "parameters": {"power": 3}}, "formula.parameters.power", "must be one of"),
        ({}, "formula", "needs exactly one of"),
        ({"name": "hast", "inline": PLAIN}, "formula", "got name and inline"),
        ({"nam": "hast"}, "formula", "did you mean 'name'?"),
        ({"inline": {**PLAIN, "map": ["x", "y", "q"]}}, "formula.inline.map.2", "unknown name 'q'"),
        ({"inline": 3}, "formula.inline", "must be a mapping"),
        ({"name": "hast", "bailout": -1}, "formula.bailout", "must be a number above 0"),
        ({"chain": []}, "formula.chain", "must be a list of formulas"),
        ({"chain": [{"name": "bulbox"}]}, "formula.chain.0.name", "cannot hold another chain"),
        (
            {"chain": [{"name": "hast", "count": 0}]},
            "formula.chain.0.count",
            "must be a whole number, 1 to 1000",
        ),
        ({"chain": [{"name": "hast", "parameters": {"x": 1}}]}, "formula.chain.0.parameters.x", "unknown"),
        ({"chain": [{"name": "hast"}], "parameters": {"power": 2}}, "formula.parameters", "no parameters"),
        ({"chain": [{"name": "hast"}, {"name": "tetrabrot"}]}, "formula.chain", "equally many variables"),
        ({"chain": [{"name": "hast"}] * 65}, "formula.chain", "at most 64"),
        ({"file": "mine.yaml"}, "formula.file", "needs a scene file"),
    ],
)
def test_a_wrong_section_is_one_located_error(spec: dict[str, Any], path: str, words: str) -> None:
    refused(lambda: catalog.resolve(spec, None, Where(path="formula")), path, words)


# --- one program for all values of parameters ---


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
    counted = np.int32(chain.starts_counted)
    out = at_points(kernels(precision), f"orbits_f{number}", at, planes, counted, constants)
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
        duals = [constant_dual(z, 3) for z in state[: chain.size]]
        rows = [[np.broadcast_to(v, len(at)) for v in (d.value, *d.partials)] for d in duals]
        found.append(np.array(rows, dtype=float))
        if n < steps + first:
            bound = chain.link_at(n).bound
            state = apply(bound, state, constant_of(bound, point), backend, number=n, carried=chain.carried)
    return np.array(found[first:])


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
@pytest.mark.parametrize("name", every(2, LIVE))
def test_every_value_of_the_library(name: str, precision: Precision) -> None:
    check_usable(precision)
    unit = float(np.finfo(precision).eps)
    compared = 0
    for parameters in ({}, *values_of(name)):
        chain = catalog.load_chain(spec_of(name, parameters))
        at = points_of(chain)[:10]
        with np.errstate(all="ignore"):
            expected = oracle(chain, at, NumpyBackend())
        # An angle times the power: its rounding is the power's multiple of one number's.
        width = spread(partial(oracle, chain, at), 8 * unit)
        width = np.broadcast_to(width.max(axis=1, keepdims=True), width.shape)
        scale = np.abs(expected).max(axis=1, keepdims=True)
        allowed = 8 * width + 64 * chain.first.degree * unit * scale
        radius = np.sqrt((expected[:, :, 0] ** 2).sum(axis=1))
        near = np.logical_and.accumulate(radius <= FAR, axis=0)[:, None, None]
        near = np.broadcast_to(near, expected.shape) & np.isfinite(allowed)
        for as_any in (False, True):
            got = orbits(name, parameters, at, precision, as_any=as_any)
            for rows in (got[:, :, 1:], got[:, :, [0, 2, 3, 4]]):
                wrong = near & ~(np.abs(rows - expected) <= allowed)
                assert not wrong.any(), (
                    parameters,
                    np.argwhere(wrong)[0],
                    rows[wrong][0],
                    expected[wrong][0],
                )
            compared += int(near.sum())
    assert compared > 100


@pytest.mark.parametrize("power", [2, 5, 2.5, 8.0])
def test_a_mandelbulb_against_forty_digits(power: float) -> None:
    check_usable("float64")
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
    check_usable("float64")
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
