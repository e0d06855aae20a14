"""The language's later words: numbers of applications, carried numbers, distances of one's own, statements, vectors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clfractal.device.tune import accepted_lanes
from clfractal.formulas import catalog
from clfractal.formulas.backends import NumpyBackend
from clfractal.formulas.blocks import run, trimmed
from clfractal.formulas.chain import Chain
from clfractal.formulas.jumps import jumps_of
from clfractal.formulas.opencl import forget_texts, write_formula
from clfractal.formulas.reference import distance, escape, own_distance
from clfractal.geometry.solids import Body
from clfractal.integrators import points as at_points
from clfractal.scene.load import load_scene
from tests.devices import device
from tests.formulas.grown import (
    CARRIED,
    GROWN,
    LOOPS,
    NUMBERED,
    STATEMENTS,
    VECTORS,
    XYZ,
    ball,
    chain_of,
    function,
    text_of,
)

Floats = NDArray[np.float64]


# --- the same formula, said in several ways ---

BOX: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "parameters": {"scale": 2},
    "do": [
        {name: f"clamp({name}, -1, 1)*2 - {name}" for name in "xyz"},
        {"r2": "x*x + y*y + z*z"},
        {
            "when": "r2 < 0.25",
            "do": [{name: f"{name}*4" for name in "xyz"}],
            "else": [{"when": "r2 < 1", "do": [{name: f"{name}*(1/r2)" for name in "xyz"}]}],
        },
        {name: f"scale*{name}" for name in "xyz"},
    ],
    "bounds": {"radius": 6},
    "bailout": 100,
}


def test_statements_are_the_formula_that_let_and_map_are() -> None:
    box = catalog.load_chain({"name": "mandelbox", "parameters": {"scale": 2}})
    points = ball(4.0)
    expected = escape(box, points, 12, 100)
    for own in (chain_of(BOX), chain_of(_vector_box())):
        got = escape(own, points, 12, 100)
        assert (got[0] == expected[0]).mean() > 0.99
        on_device = at_points.escape(
            own, points, 12, device=device(), lanes=1, precision="float64", bailout=100
        )
        assert (on_device[0] == expected[0]).mean() > 0.99


def _vector_box() -> dict[str, Any]:
    do = [
        {"v": "fold(v, 1)"},
        {"r2": "dot(v, v)"},
        {"when": "r2 < 0.25", "do": [{"v": "v*4"}], "else": [{"when": "r2 < 1", "do": [{"v": "v*(1/r2)"}]}]},
        {"v": "scale*v"},
    ]
    return {**BOX, "variables": {"v": 3}, "do": do}


# |z_n| = |p|^(2^n), and its derivative is a product: half of |z| log|z| over it is |p| log|p| / 2 after any count.
SQUARED_BALL: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "state": {"size": {"start": 1, "next": "2*r*size"}},
    "let": {"r": "sqrt(x*x + y*y + z*z)"},
    "map": ["x*r", "y*r", "z*r"],
    "distance": "0.5*r*log(r)/size",
    "add": "none",
    "degree": 2,
    "bounds": {"radius": 1.1},
}


@pytest.mark.parametrize("lanes", accepted_lanes(device(), "float32"))
def test_a_distance_of_ones_own_is_the_one_that_rays_march_by(lanes: int) -> None:
    chain, points = chain_of(SQUARED_BALL), ball(2.0)
    size = np.linalg.norm(points, axis=1)
    expected = np.where(size > 4 ** (1 / 256), 0.5 * size * np.log(np.maximum(size, 1)), 0)
    np.testing.assert_allclose(own_distance(chain, points, 8), expected, rtol=1e-6, atol=1e-3)
    got = at_points.distances(chain, points, 8, device=device(), lanes=lanes)
    np.testing.assert_allclose(got.step, expected, rtol=1e-4, atol=1e-3)
    # The check: that of the Jacobian, which has factors of its own near and far; and its normals.
    assert (got.inside == (size < 4 ** (1 / 256))).mean() > 0.99
    np.testing.assert_allclose(got.full, distance(chain, points, 8)[0], rtol=1e-3, atol=1e-4)
    outside = size > 1.05
    np.testing.assert_allclose(got.normal[outside], (points / size[:, None])[outside], atol=1e-4)


def test_a_distance_of_degree_1_is_a_shape_in_scene_units() -> None:
    library = catalog.load_chain("octahedral_ifs")
    flake = {
        "variables": ["x", "y", "z"],
        "state": {"size": 1},
        "do": [
            {"ax": "abs(x)", "ay": "abs(y)", "az": "abs(z)"},
            {
                "x": "2*max(ax, ay, az) - 1",
                "y": "2*max(min(ax, ay), min(max(ax, ay), az))",
                "z": "2*min(ax, ay, az)",
                "size": "2*size",
            },
        ],
        "distance": "(abs(x) + abs(y) + abs(z) - 1)/sqrt(3)/size",
        "add": "none",
        "bounds": {"radius": 1},
        "bailout": 1.02,
    }
    own, points = chain_of(flake), ball(1.2)
    options: dict[str, Any] = {"device": device(), "lanes": 1, "precision": "float64"}
    expected = at_points.distances(library, points, 7, **options)
    got = at_points.distances(own, points, 7, **options)
    np.testing.assert_allclose(got.step, expected.step, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(got.full, expected.full, rtol=1e-9, atol=1e-12)
    assert (got.inside == expected.inside).all()
    np.testing.assert_allclose(got.normal, expected.normal, atol=1e-9)


def test_a_derivative_of_ones_own_begins_at_0_where_the_point_is_added() -> None:
    """The first application of the Mandelbox gives the point, whose derivative is 1."""
    library = catalog.load_chain({"name": "mandelbox", "parameters": {"scale": 2}, "bailout": 30})
    r, k = "sqrt(x*x + y*y + z*z)", "2/clamp(r2, 0.25, 1)"
    folds = {f"f{name}": f"clamp({name}, -1, 1)*2 - {name}" for name in "xyz"}
    own = {
        **XYZ,
        "state": {"size": {"start": 0, "next": "k*size + 1"}},
        "let": {**folds, "r2": "fx*fx + fy*fy + fz*fz", "k": k},
        "map": ["fx*k", "fy*k", "fz*k"],
        "distance": f"({r} - 30)/size",
        "bailout": 30,
    }
    points = ball(16.0)
    options: dict[str, Any] = {"device": device(), "lanes": 1, "precision": "float64"}
    expected = at_points.distances(library, points, 8, **options)
    got = at_points.distances(chain_of(own), points, 8, **options)
    assert (got.inside == expected.inside).mean() > 0.99
    outside = ~got.inside & ~expected.inside
    assert outside.sum() > 50
    np.testing.assert_allclose(got.step[outside], expected.step[outside], rtol=1e-6)


@pytest.mark.parametrize("name", ["carried", "carried, Julia"])
def test_the_kernels_distance_is_that_of_numpy(name: str) -> None:
    chain, points = catalog.load_chain(GROWN[name]), ball(1.4, 100)
    got = at_points.distances(chain, points, 4, device=device(), lanes=1, precision="float64")
    np.testing.assert_allclose(got.step, own_distance(chain, points, 4), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", list(GROWN))
def test_counts_on_the_device(name: str) -> None:
    chain, points = catalog.load_chain(GROWN[name]), ball(1.4, 400)
    expected = escape(chain, points, 9)
    got = at_points.escape(chain, points, 9, device=device(), lanes=1, precision="float64")
    assert len(set(expected[0])) > 1
    assert (got[0] == expected[0]).mean() > 0.99


# --- what is written ---


def test_over_duals_goes_what_z_depends_on_and_partials_where_there_is_a_slope() -> None:
    text = text_of(CARRIED)
    assert "real s0, s1, s2, e0, e1, e2, e3;" in text
    both = text.partition("typedef struct {\n    dual s0, s1, s2;")[2].partition("}")[0]
    assert both.split() == ["real", "e0;", "dual", "e2;"]


def test_what_a_parameter_has_switched_off_is_a_branch_or_is_not_there() -> None:
    text = text_of(STATEMENTS)
    usual, general = function(text, "real_usual_0"), function(text, "real_apply_0")
    assert general.count("if (k[") == 2
    assert "if (k[" not in usual
    for name in ("real_apply_0", "dual_apply_0"):
        assert function(text, name).count("((scalar)n)") >= 1


def test_results_that_nobody_needs_are_not_written() -> None:
    formula = {
        **BOX,
        "do": [{"unused": "exp(x)"}, {"x": "x*x", "w": "sin(y)"}, {"loop": 3, "do": [{"w": "w*2"}]}],
    }
    text = text_of(formula)
    assert "exp" not in text
    assert "sin" not in text


def test_short_loops_are_written_out_and_long_ones_are_loops() -> None:
    def loops(turns: int) -> int:
        return function(
            text_of({**BOX, "do": [{"loop": turns, "do": [{"x": "x*x"}]}]}), "real_apply_0"
        ).count("for (")

    assert [loops(turns) for turns in (0, 3, 8, 9, 64)] == [0, 0, 0, 1, 1]


def test_a_costly_arm_is_done_where_a_lane_takes_it() -> None:
    do = [{"when": "x > 0", "do": [{"y": "sin(y)*cos(z)*exp(x)"}]}]
    assert "any_lane(" in function(text_of({**BOX, "do": do}), "real_apply_0")
    assert "any_lane(" not in function(
        text_of({**BOX, "do": [{"when": "x > 0", "do": [{"y": "y*z"}]}]}), "real_apply_0"
    )


def test_the_number_is_never_left_behind() -> None:
    """Lanes of a packet must be at the same application, and equal z have other futures."""
    chain = chain_of(NUMBERED)
    assert "CARRIES_ORBITS 0" in write_formula(chain).text
    assert chain.repeats_from > 10**9
    assert chain_of(CARRIED).repeats_from > 10**9
    # A formula of the library's may call something else n.
    own = chain_of({**BOX, "parameters": {"scale": 2, "n": 3}, "do": [{"x": "x*n"}]})
    assert not own.first.formula.numbered


# --- turns as data ---


def hybrid(*members: dict[str, Any]) -> Chain:
    return catalog.load_chain({"chain": list(members)})


TURNS: list[tuple[dict[str, Any], dict[str, Any], dict[str, Any]]] = [
    ({}, {}, {}),
    ({"count": 2}, {}, {"count": 3}),
    ({"stop": 3}, {"start": 1}, {"start": 4}),
    ({"count": 5, "start": 0}, {"start": 2, "stop": 9}, {"start": 3}),
]


@pytest.mark.parametrize("turns", TURNS)
def test_counts_and_ranges_are_in_no_text(turns: Any) -> None:
    def members(turns: Any) -> Chain:
        formulas = ({"inline": BOX}, {"inline": STATEMENTS}, {"inline": NUMBERED})
        return hybrid(*({**formula, **turn} for formula, turn in zip(formulas, turns, strict=True)))

    forget_texts()
    plain = write_formula(members(TURNS[0]))
    chain = members(turns)
    assert write_formula(chain).text == plain.text
    points = ball(2.5, 300)
    expected = escape(chain, points, 14, 4)
    got = at_points.escape(chain, points, 14, device=device(), lanes=1, precision="float64", bailout=4)
    assert len(set(expected[0])) > 2
    assert (got[0] == expected[0]).mean() > 0.98


def test_members_share_numbers_of_one_name() -> None:
    one = {**BOX, "state": {"m": 0.5}, "do": [{"m": "2*m"}, {"x": "x*x - y*y", "y": "2*x*y"}]}
    other = {**BOX, "state": {"m": 7, "u": 1}, "do": [{"x": "x + m", "u": "u + m"}]}
    chain = hybrid({"inline": one}, {"inline": other}, {"name": "hast"})
    assert chain.carried == ("m", "u")
    assert chain.begins("m")[0] == 0
    points = ball(0.5, 50)
    got = at_points.escape(chain, points, 9, device=device(), lanes=1, precision="float64")
    assert (got[0] == escape(chain, points, 9)[0]).all()


# --- statements and numbers of any kind ---


@pytest.mark.parametrize("formula", [STATEMENTS, LOOPS, VECTORS])
def test_arrays_are_what_their_numbers_are_one_by_one(formula: dict[str, Any]) -> None:
    bound = chain_of(formula).first
    steps, variables = bound.formula.steps, bound.formula.variables
    states = np.random.default_rng(4).uniform(-1, 1, (60, 3))
    for number in range(3):
        fixed: dict[str, Any] = {"n": float(number), **bound.values}
        for each in bound.formula.state:
            fixed[each.name] = 1.0
        fixed |= {f"point.{letter}": 0.3 for letter in "xyz"}
        together = {**fixed, **dict(zip(variables, states.T.copy(), strict=True))}
        with np.errstate(all="ignore"):
            run(steps, together, NumpyBackend())
        for index, state in enumerate(states):
            alone = {**fixed, **dict(zip(variables, map(float, state), strict=True))}
            run(steps, alone)
            for name in variables:
                value = np.broadcast_to(together[name], len(states))[index]
                assert value == pytest.approx(alone[name], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("formula", [STATEMENTS, LOOPS, VECTORS])
def test_what_is_left_out_changes_nothing(formula: dict[str, Any]) -> None:
    bound = chain_of(formula).first
    steps, variables = bound.formula.steps, bound.formula.variables
    for wanted in (variables, variables[:1], variables[2:]):
        short, needed = trimmed(steps, frozenset(wanted))
        for state in np.random.default_rng(5).uniform(-1, 1, (20, 3)):
            names: dict[str, Any] = {"n": 2.0, **bound.values, **{f"point.{a}": 0.3 for a in "xyz"}}
            names |= {each.name: 0.7 for each in bound.formula.state}
            names |= dict(zip(variables, map(float, state), strict=True))
            whole, less = dict(names), {name: names[name] for name in needed if name in names}
            run(steps, whole)
            run(short, less)
            assert [less[name] for name in wanted] == [whole[name] for name in wanted]


# --- where there is no slope ---


def test_where_a_formula_jumps_is_told() -> None:
    told = jumps_of(chain_of(STATEMENTS).first.formula)
    assert told == ("(x > y)", "(z < 0.0)", "(u > 0.2)")
    assert jumps_of(
        chain_of({**XYZ, "map": ["floor(x)", "where(n > 2, y, -y)", "abs(z)"]}).first.formula
    ) == ("floor(x)",)


def test_a_switch_is_off_whatever_else_its_condition_asks() -> None:
    """With its usual value nothing is left of what it would do; other values of the rest are data."""
    do = [
        {"when": "on > 0 and (n >= first or not x > 0)", "do": [{"x": "sin(x)"}], "else": [{"y": "cos(y)"}]}
    ]
    formula = {**XYZ, "parameters": {"on": 0, "first": 2}, "do": do}
    text = text_of(formula)
    assert "sin(" not in function(text, "real_usual_0")
    assert "if (" not in function(text, "real_usual_0")
    assert "sin(" in function(text, "real_apply_0")
    assert text_of(formula, parameters={"on": 1, "first": 7}) is text


# --- among joined solids ---


@pytest.mark.parametrize(
    ("own", "other"),
    [("carried", "hast"), pytest.param("statements", "vectors", marks=pytest.mark.combination)],
)
def test_joined_formulas_are_those_by_themselves(own: str, other: str) -> None:
    """Two sets far apart: near each one distances, normals and counts are its own."""
    specs = {**GROWN, "hast": {"name": "hast"}}
    place = [40.0, 0.0, 0.0]
    second = {"type": "formula", "formula": {**specs[other], "iterations": 5}, "position": place}
    scene = load_scene(
        {"version": 1, "formula": {**specs[own], "iterations": 5}, "camera": {}, "objects": {"other": second}}
    )
    options: dict[str, Any] = {"device": device(), "lanes": 1, "precision": "float64"}
    for number, name in enumerate((own, other)):
        points = ball(1.4, 200)
        alone = at_points.distances(catalog.load_chain(specs[name]), points, 5, **options)
        found, objects = at_points.nearest(Body.of(scene), points + number * np.array(place), **options)
        assert (objects == number).all()
        outside = ~alone.inside & ~found.inside
        assert (found.inside == alone.inside).mean() > 0.99
        # (Together they march by the Jacobian, if not all have a distance of their own.)
        np.testing.assert_allclose(found.full[outside], alone.full[outside], rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(found.smooth[outside], alone.smooth[outside], rtol=1e-5, atol=1e-6)
