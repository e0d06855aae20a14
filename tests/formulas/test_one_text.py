"""One text for all values of parameters; and a text that is kept is the one that would be written."""

from __future__ import annotations

import cProfile
import math
import pickle
import re
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clfractal
from clfractal.device.select import choose
from clfractal.formulas import catalog
from clfractal.formulas.chain import Chain
from clfractal.formulas.language import Parameter
from clfractal.formulas.opencl import FormulaText, forget_texts, write_formula
from clfractal.formulas.together import write_together
from clfractal.geometry.solids import Body
from clfractal.integrators.points import distances, nearest
from clfractal.scene.load import load_scene
from tests.variants import combinations, every

SINGLE = [name for name in catalog.names() if not catalog.is_chain(name)]
WITH_PARAMETERS = [name for name in SINGLE if catalog.load(name).parameters]
# Who changes what the writer writes on purpose records them anew.
# Everything that asks for a decision: conditions, exponents, 0 and 1, a repeat, f(0), divisors.
DECIDING: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "parameters": {
        "p": {"default": 2, "minimum": -3, "maximum": 3},
        "q": {"default": 0.5, "minimum": -2, "maximum": 2},
        "n": {"type": "int", "default": 1, "minimum": 1, "maximum": 4},
        "b": {"default": 2, "minimum": -2, "maximum": 3, "baked": True},
    },
    "let": {"twice": "2*q", "some": "where(p > 1 or q == 0, p*q, 1)", "r": "x*x + y*y"},
    "map": [
        "where(p == 1, x, x*x*twice) + some*y + where(twice > 0 and x > 0, y/where(q == 0, 1, q), y)",
        "cpow_im(x, y, b)*q + cpow_re(x, y, p*p)*where(q != 0, q, 1) + p",
        "z**b + where(p > 0, r**p, r) - where(not q < p, 1, z)",
    ],
    "repeat": "n",
    "degree": 2,
    "bounds": {"radius": "2 + abs(q)"},
}
deciding = st.fixed_dictionaries(
    {
        "p": st.sampled_from([-0.0, 0, 0.5, 1, 2, 3]) | st.floats(0, 3),
        "q": st.sampled_from([-0.0, 0, 0.5, 1, -1]) | st.floats(-2, 2).map(lambda v: round(v, 3)),
        "n": st.integers(1, 4),
        "b": st.sampled_from([0, 1, 2, 0.5, 3]) | st.floats(0, 3),
    }
)


def values_of(parameter: Parameter) -> st.SearchStrategy[float]:
    """Any value that the parameter may have, 0 and 1 and whole numbers more often."""
    if parameter.choices is not None:
        return st.sampled_from(parameter.choices)
    low, high = parameter.minimum or 0.0, parameter.maximum or 4.0
    whole = [float(v) for v in range(math.ceil(low), math.floor(high) + 1)]
    if parameter.type == "int":
        return st.sampled_from(whole)
    return (st.sampled_from(whole) if whole else st.nothing()) | st.floats(low, high)


def drawn(data: st.DataObject, name: str) -> dict[str, float]:
    return {p.name: data.draw(values_of(p), label=p.name) for p in catalog.load(name).parameters}


def loaded(spec: dict[str, Any]) -> Chain | None:
    """None for values that give the formula no meaning (a radius that gets too large, an infinite f(0))."""
    try:
        return catalog.load_chain(spec)
    except clfractal.FormulaError:
        return None


def chains_of(specs: list[dict[str, Any]]) -> list[Chain]:
    return [chain for chain in map(loaded, specs) if chain is not None]


SLIDERS = [(name, parameter) for name in WITH_PARAMETERS for parameter in catalog.load(name).parameters]


def places(parameter: Parameter) -> list[float]:
    """Where a slider may stand: both ends, its usual place, whole and half numbers, and others between."""
    if parameter.choices is not None:
        return list(parameter.choices)
    assert parameter.minimum is not None
    assert parameter.maximum is not None
    low, high = parameter.minimum, parameter.maximum
    found = [low + (high - low) * part / 13 for part in range(14)]
    found += [half / 2 for half in range(math.ceil(2 * low), math.floor(2 * high) + 1)]
    return sorted({round(v) for v in found} if parameter.type == "int" else {*found, parameter.default})


@pytest.mark.parametrize(("name", "parameter"), every(2, SLIDERS), ids=[f"{n}-{p.name}" for n, p in SLIDERS])
def test_a_slider_keeps_the_text(name: str, parameter: Parameter) -> None:
    chains = chains_of([{"name": name, "parameters": {parameter.name: value}} for value in places(parameter)])
    assert len(chains) > 1
    texts = []
    for chain in chains:
        forget_texts()
        texts.append(write_formula(chain).text)
    assert len(set(texts)) == 1


@given(first=deciding, second=deciding, live=st.sets(st.sampled_from(["p", "q", "n", "b"])))
@settings(max_examples=150)
def test_one_text_whatever_is_decided(first: Any, second: Any, live: set[str]) -> None:
    texts, starts = [], set()
    for chain in chains_of(
        [{"inline": DECIDING, "parameters": each, "live": sorted(live)} for each in (first, second)]
    ):
        forget_texts()
        texts.append(write_formula(chain))
        starts.add(chain.first.start is None)
    assert len({text.text for text in texts}) <= len(starts)
    assert len({len(text.constants) for text in texts}) <= len(starts)


def same(a: FormulaText, b: FormulaText) -> bool:
    """Also of 0.0 and -0.0."""
    return a == b and repr(a) == repr(b)


@given(
    many=st.lists(deciding, min_size=2, max_size=6),
    options=st.fixed_dictionaries(
        {"dual_map": st.sampled_from(["operations", "jacobian", "cheapest"]), "scalar_rule": st.booleans()}
    ),
    julia=st.none() | st.lists(st.sampled_from([0.0, 1.0, 0.3]), min_size=3, max_size=3),
)
@settings(max_examples=80)
def test_a_text_that_is_kept_is_what_would_be_written(many: list[Any], options: Any, julia: Any) -> None:
    common = {"inline": DECIDING, "julia": julia}
    chains = chains_of([{**common, "parameters": parameters} for parameters in many])
    anew = []
    for chain in chains:
        forget_texts()
        anew.append(write_formula(chain, **options))
    forget_texts()
    kept = [write_formula(chain, **options) for chain in chains]
    assert all(map(same, anew, kept))


@pytest.mark.parametrize("name", WITH_PARAMETERS)
@given(data=st.data())
@settings(max_examples=8)
def test_kept_texts_of_the_library(name: str, data: st.DataObject) -> None:
    found = chains_of([{"name": name, "parameters": drawn(data, name)} for _ in range(3)])
    anew = []
    for chain in found:
        forget_texts()
        anew.append(write_formula(chain))
    forget_texts()
    assert all(map(same, anew, map(write_formula, found)))


def test_a_number_of_repeats_is_in_no_text() -> None:
    two, eight = (
        write_formula(catalog.load_chain({"name": "hast", "parameters": {"power": p}})) for p in (2, 8)
    )
    assert two.text is eight.text
    assert "pass < (int)k[" in two.text
    # Whether the values are the usual ones, and log2 of the power.
    assert [(a, b) for a, b in zip(two.constants, eight.constants, strict=True) if a != b] == [(1, 0), (1, 3)]


def test_values_of_a_chains_members_are_in_no_text() -> None:
    def text(power: float, scale: float) -> str:
        links = [
            {"name": "mandelbulb", "parameters": {"power": power}},
            {"name": "mandelbox", "parameters": {"scale": scale}},
        ]
        return write_formula(catalog.load_chain({"chain": links})).text

    assert text(2, -1.5) is text(8.5, -1.5)
    assert text(2, -1.5) is text(2, 1)


def test_usual_values_are_those_of_the_formula() -> None:
    def usual(**values: float) -> float:
        return write_formula(catalog.load_chain({"name": "mandelbulb", "parameters": values})).constants[0]

    assert usual() == usual(power=8.0) == 1
    assert usual(power=7) == usual(power=8.5) == usual(phi_phase=0.1) == 0
    # What chooses between no ways to compute is passed, and may be anything.
    box = catalog.load_chain({"name": "mandelbox", "parameters": {"scale": -1.7}})
    assert "return 1;" in write_formula(box).text.partition("has_usual_values")[2].partition("}")[0]


def test_a_condition_is_decided_by_the_host_in_every_precision() -> None:
    spec = {"name": "mandelbulb"}
    even, odd = (
        write_formula(catalog.load_chain({**spec, "parameters": {"power": power}}))
        for power in (4, 4 + 1e-12)
    )
    assert even.text is odd.text
    assert sum(a != b for a, b in zip(even.constants, odd.constants, strict=True)) > 1


ERRORS = [
    ({"name": "mandelbulb", "live": ["powr"]}, "formula.live.0", "did you mean 'power'?"),
    ({"name": "makin_brot", "live": ["power"]}, "formula.live.0", "unknown parameter 'power'; known: none"),
    ({"name": "bulbox", "live": ["power"]}, "formula.live", "a chain has no parameters of its own"),
    (
        {"chain": [{"name": "hast", "live": ["power", "pover"]}]},
        "formula.chain.0.live.1",
        "did you mean 'power'?",
    ),
    ({"chain": [{"name": "hast"}], "live": ["power"]}, "formula.live", "belongs to the members of a chain"),
    ({"name": "hast", "live": "power"}, "formula.live", "must be a list"),
    ({"name": "hast", "live": [3]}, "formula.live.0", "must be text"),
]


@pytest.mark.parametrize(("formula", "path", "message"), ERRORS)
def test_mistakes_are_told_with_their_place(formula: Any, path: str, message: str) -> None:
    with pytest.raises(Exception, match="formula") as caught:
        clfractal.load_scene({"version": 1, "formula": formula, "camera": {}})
    assert f"{path}: " in str(caught.value)
    assert message in str(caught.value)


def inline(**changes: Any) -> dict[str, Any]:
    return {
        "variables": ["x", "y", "z"],
        "parameters": {"p": 2},
        "map": ["x*x - y*y", "2*x*y", "z*z"],
        "bounds": {"radius": 2},
        "degree": 2,
        **changes,
    }


def test_a_degree_of_1_and_an_infinite_f0_are_texts_of_their_own() -> None:
    def written(p: float, **changes: Any) -> FormulaText:
        return write_formula(catalog.load_chain({"inline": inline(**changes), "parameters": {"p": p}}))

    one, more, most = (written(p, degree="p") for p in (1, 1.5, 3))
    assert more.text is most.text
    assert (one.facts.logarithmic, more.facts.logarithmic) == (False, True)
    start = {"map": ["x*x - y*y + p**-1", "2*x*y", "z*z"]}
    assert "#define FIRST_COUNT 1" in written(0.5, **start).text
    assert written(0.5, **start).constants[0] == 2.0
    assert written(0.5, **start).text is written(2, **start).text


def test_a_branch_that_is_not_taken_may_be_no_number() -> None:
    formula = inline(map=["x*x - y*y", "where(p > 0, 2*x*y*p**-1, 2*x*y)", "z*z"], add="none")
    spec = {"inline": formula, "parameters": {"p": 0}}
    assert float("inf") in write_formula(catalog.load_chain(spec)).constants
    plain = {"inline": {**formula, "map": ["x*x", "2*x*y*p**-1", "z"]}, "parameters": {"p": 0}}
    with pytest.raises(clfractal.FormulaError, match="is not a finite number"):
        write_formula(catalog.load_chain(plain))


def test_chains_are_equal_that_give_the_same_picture() -> None:
    spec = {"name": "mandelbulb", "parameters": {"theta_phase": 0.3}}
    assert (
        catalog.load_chain(spec)
        == catalog.load_chain(spec)
        == catalog.load_chain({**spec, "live": ["power"]})
    )
    assert hash(catalog.load_chain(spec)) == hash(catalog.load_chain(spec))
    others: list[dict[str, Any]] = [
        {**spec, "parameters": {"theta_phase": 0.4}},
        {**spec, "bailout": 5},
        {**spec, "julia": [0, 0, 0]},
        {"name": "hast"},
    ]
    assert all(catalog.load_chain(spec) != catalog.load_chain(other) for other in others)
    written = {"inline": inline()}
    assert catalog.load_chain(written) == catalog.load_chain({"inline": inline()})
    assert catalog.load_chain(written) != catalog.load_chain({"inline": inline(map=["x", "y", "z"])})


def test_a_chain_can_be_sent_elsewhere() -> None:
    chain = catalog.load_chain({"name": "mandelbulb", "live": ["power"]})
    text = write_formula(chain)
    sent = pickle.loads(pickle.dumps(chain))
    assert sent.radius == chain.radius
    assert write_formula(sent) == text


def test_a_dragged_parameter_costs_hardly_any_time() -> None:
    """In calls of functions, which do not depend on what else a machine does: some 600 of 60,000 that writing takes."""
    scene = clfractal.load_scene({"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}})

    def calls(chain: Chain) -> int:
        counted = cProfile.Profile()
        counted.runcall(write_formula, chain)
        return sum(each.callcount for each in counted.getstats())

    def moved(phase: float) -> Chain:
        formula = scene.formula.model_copy(update={"parameters": {"theta_phase": phase}})
        return scene.model_copy(update={"formula": formula}).chain

    write_formula(moved(0.1))
    kept = calls(moved(0.2))
    forget_texts()
    assert kept * 10 < calls(moved(0.3))


# --- several formulas in one text: each is a leaf with a name of its own, whose number stands before its constants ---


# Of three and four numbers, with scalar rules and without, a chain, and a shape: (the formula, applications).
KINDS = {
    "mandelbulb": 6,
    "quaternion_julia": 8,
    "quaternion_mandelbrot": 8,
    "hast": 9,
    "mandelbox": 7,
    "mengerbulb": 5,
    "sierpinski_tetrahedron": 6,
}
APART = 40.0


def names_of(text: str) -> list[str]:
    """The names of all functions and types."""
    return re.findall(r"^INLINE \w+ (\w+)\(|^\} (\w+);", text, re.MULTILINE)


def test_each_leaf_has_names_of_its_own() -> None:
    chains = tuple(map(catalog.load_chain, KINDS))
    found = names_of(write_together(chains).text)
    assert len(set(found)) == len(found)


def test_equal_functions_are_there_once_with_constants_for_each() -> None:
    near, far = (
        catalog.load_chain({"name": "mandelbulb", "live": ["power"], "parameters": {"power": power}})
        for power in (7.5, 8.5)
    )
    together = write_together((near, catalog.load_chain("hast"), far))
    assert [together.constants[first - 1] for first in together.firsts] == [0, 1, 0]
    assert together.formulas[0].text is together.formulas[2].text
    for chain, first, written in zip((near, far), together.firsts[::2], together.formulas[::2], strict=True):
        own = write_formula(chain).constants
        assert len(written.constants) <= len(own)
        assert together.constants[first : first + len(written.constants)] == written.constants
    assert together.formulas[0].constants != together.formulas[2].constants


# Each beside the next one, so each once as the set and once as the other.
PAIRS = list(pairwise([*KINDS, next(iter(KINDS))]))


@pytest.mark.parametrize(
    ("own", "other"),
    [*PAIRS, *combinations(sorted({*product(("hast", "quaternion_julia"), KINDS)} - {*PAIRS}))],
)
def test_each_formula_is_that_by_itself(own: str, other: str) -> None:
    """Two sets far apart: near each one the distances, normals and counts are its own."""
    place = [APART, 0.0, 0.0]
    objects: dict[str, Any] = {
        "other": {
            "type": "formula",
            "formula": {"name": other, "iterations": KINDS[other]},
            "position": place,
        }
    }
    formula = {"name": own, "iterations": KINDS[own]}
    camera = {"position": [0, -9, 0], "target": [0, 0, 0]}
    scene = load_scene({"version": 1, "formula": formula, "camera": camera, "objects": objects})
    body = Body.of(scene)
    device = choose()
    for number, (chain, at) in enumerate(
        [(scene.chain, [0.0, 0.0, 0.0]), (scene.joined_chains["other"], place)]
    ):
        rng = np.random.default_rng(number)
        arm = rng.normal(size=(400, 3))
        radii = rng.uniform(0.0, 1.0, 400) ** (1 / 3)
        points = (
            np.array(chain.center)
            + chain.radius * radii[:, None] * arm / np.linalg.norm(arm, axis=1)[:, None]
        )
        alone = distances(
            chain, points, KINDS[(own, other)[number]], device=device, lanes=1, precision="float64"
        )
        found, objects_of = nearest(body, points + at, device=device, lanes=1, precision="float64")
        outside = ~alone.inside
        assert (found.inside == alone.inside).mean() > 0.995
        assert (objects_of == number).all()
        same = outside & ~found.inside
        np.testing.assert_allclose(found.full[same], alone.full[same], rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(found.smooth[same], alone.smooth[same], rtol=1e-5, atol=1e-6)
        assert np.median((found.normal * alone.normal).sum(axis=1)[same]) > 1 - 1e-9
