"""Formulas from mappings, parameters, binding and chains: what is allowed, and the errors for the rest."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from clfractal.errors import FormulaError, Where
from clfractal.formulas import catalog
from clfractal.formulas.language import BoundFormula, bind, formula_from_mapping, to_text

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
    with pytest.raises(FormulaError) as caught:
        formula(**changes)
    assert words in caught.value.message
    assert caught.value.where.path == path
    assert "\n" not in str(caught.value)


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
    with pytest.raises(FormulaError) as caught:
        bound(parameters)
    assert words in caught.value.message
    assert caught.value.where.path == path


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
    with pytest.raises(FormulaError) as caught:
        bind(formula(**changes))
    assert words in caught.value.message


def test_a_division_guarded_by_where_is_allowed() -> None:
    bind(formula(map=["where(power > 2, x/(power - 2), x)", "y", "z"]))


def test_a_julia_constant_replaces_the_point() -> None:
    f = bound(julia=[0.1, 0.2, 0.3])
    assert (f.add, f.julia) == ("constant", (0.1, 0.2, 0.3))
    assert f.center == (0.0, 0.0, 0.0)
    for wrong in ([0.1, 0.2], "abc", [0, 0, None], [0, 0, 1e9], [0, 0, float("nan")]):
        with pytest.raises(FormulaError) as caught:
            bound(julia=wrong)
        assert (caught.value.where.path or "").startswith("formula.julia")
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
    with pytest.raises(FormulaError) as caught:
        catalog.resolve(spec, None, Where(path="formula"))
    assert words in caught.value.message
    assert caught.value.where.path == path
