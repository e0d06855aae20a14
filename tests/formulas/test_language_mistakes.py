"""Mistakes in the language's later words, told with their place; and limits of what is written."""

from __future__ import annotations

from typing import Any

import pytest

from clfractal.errors import FormulaError
from clfractal.formulas.opencl import write_formula
from tests.formulas.grown import (
    XYZ,
    chain_of,
    function,
    text_of,
)

MISTAKES: list[tuple[dict[str, Any], str, str]] = [
    ({"do": [], "map": ["x", "y", "z"]}, "", "has both `map` and `do`"),
    ({}, "", "lacks the key 'map', or 'do'"),
    ({"do": {"x": "y"}}, "do", "must be a list of statements"),
    ({"do": ["x = y"]}, "do.0", "must be `name: expression`"),
    ({"do": [{"x": "u"}]}, "do.0.x", "unknown name 'u'"),
    ({"do": [{"n": "x"}]}, "do.0.n", "'n' cannot be given a value"),
    ({"do": [{"point_x": "x"}]}, "do.0.point_x", "cannot be given a value"),
    ({"do": [{"sin": "x"}]}, "do.0.sin", "is reserved"),
    ({"do": [{"do": "x"}]}, "do.0.do", "belongs to a statement with `when` or `loop`"),
    ({"do": [{"when": "x > 0"}]}, "do.0", "lacks the key 'do'"),
    ({"do": [{"when": "x", "do": []}]}, "do.0.when", "must be a condition"),
    ({"do": [{"when": "x > 0", "doo": []}]}, "do.0", "did you mean 'do'?"),
    ({"do": [{"when": "x > 0", "do": [{"u": 1}]}, {"x": "u"}]}, "do.1.x", "unknown name 'u'"),
    ({"do": [{"loop": 3, "do": [{"u": 1}]}, {"x": "u"}]}, "do.1.x", "unknown name 'u'"),
    ({"do": [{"loop": 65, "do": []}]}, "do.0.loop", "must have 0 to 64 turns, got 65"),
    ({"do": [{"loop": 2.5, "do": []}]}, "do.0.loop", "must be a whole number, got 2.5"),
    ({"do": [{"loop": "x", "do": []}]}, "do.0.loop", "unknown name 'x'"),
    ({"do": [{"loop": "p", "do": []}], "parameters": {"p": 3}}, "do.0", "needs the key 'most'"),
    ({"do": [{"loop": "p", "most": 99, "do": []}], "parameters": {"p": 3}}, "do.0.loop", "got 99"),
    ({"do": [{"loop": 20, "as": "i", "do": [{"i": "i + 1"}]}]}, "do.0", "'i' counts the turns"),
    ({"do": [{"u": "cpow_re(x, y, n)"}]}, "do.0.u", "must be constant, but uses 'n'"),
    (
        {"do": [{"p": 2}, {"loop": 9, "do": [{"u": "cpow_re(x, y, p)"}, {"p": "p + 1"}]}]},
        "do.1.do.0.u",
        "uses 'p'",
    ),
    ({"map": ["x", "y", "z"], "state": {"x": 1}}, "state.x", "is used twice"),
    ({"map": ["x", "y", "z"], "state": {"s": {"next": 1}}}, "state.s", "lacks the key 'start'"),
    ({"map": ["x", "y", "z"], "state": {"s": "n"}}, "state.s", "unknown name 'n'"),
    ({"map": ["x", "y", "z"], "state": {"s": 1}, "repeat": 2}, "repeat", "use a `loop`"),
    ({"map": ["x", "y", "z"], "state": {"s": 1}, "derivative": "dr"}, "derivative", "say a `distance`"),
    ({"map": ["x", "y", "z"], "derivative": "dr", "distance": "x"}, "", "not both"),
    ({"map": ["x", "y", "z"], "distance": "x + n"}, "distance", "unknown name 'n'"),
    ({"map": ["x", "y", "z"], "let": {"u": "x*n"}, "distance": "u"}, "distance", "cannot use 'n'"),
    ({"variables": {"v": 5}, "map": "v"}, "variables.v", "must be 3 or 4"),
    ({"variables": {"v": 3}, "map": "v.xy"}, "map", "must be a vector of 3, got a vector of 2"),
    ({"variables": {"v": 3}, "do": [{"v": "v.x"}]}, "do.0.v", "'v' is a vector of 3, but gets a number"),
    ({"variables": {"v": 3}, "do": [{"v.w": "v.x"}]}, "do.0.v.w", "is no part of a vector"),
    (
        {"variables": {"v": 3}, "do": [{"u": "v + v.xy"}]},
        "do.0.u",
        "cannot take a vector of 3 and a vector of 2",
    ),
    ({"variables": {"v": 3}, "do": [{"u": "v.q"}]}, "do.0.u", "is no part of a vector of 3"),
    ({"variables": {"v": 3}, "do": [{"u": "dot(v, 1)"}]}, "do.0.u", "needs a vector as its argument 2"),
    (
        {"variables": {"v": 3}, "do": [{"when": "v > 0", "do": []}]},
        "do.0.when",
        "needs a number here, not a vector",
    ),
    ({"map": ["x", "y", "f(z)"], "functions": {"f": "x"}}, "functions.f", "is named as in `box(v, limit)`"),
    ({"map": ["x", "y", "f(z)"], "functions": {"f(u)": "x"}}, "functions.f(u)", "unknown name 'x'"),
    ({"map": ["x", "y", "f(z, 1)"], "functions": {"f(u)": "u"}}, "map.2", "f takes 1 argument, got 2"),
    ({"map": ["x", "y", "f(z)"], "functions": {"f(u)": "f(u)"}}, "functions.f(u)", "unknown function 'f'"),
]


@pytest.mark.parametrize(("changes", "path", "message"), MISTAKES)
def test_mistakes_are_told_with_their_place(changes: dict[str, Any], path: str, message: str) -> None:
    with pytest.raises(FormulaError) as caught:
        chain_of({**XYZ, **changes})
    assert message in caught.value.message
    assert caught.value.where.path == ".".join(filter(None, ("inline", path)))


def within(statements: list[Any], times: int, **outer: Any) -> list[Any]:
    """Statements within conditions or loops, one in the other."""
    for _ in range(times):
        statements = [{**outer, "do": statements}]
    return statements


LIMITS: list[tuple[dict[str, Any], str]] = [
    ({"do": [{"x": "x + 1"}] * 2001}, "more than 2,000 statements"),
    ({"do": within([], 17, when="x > 0")}, "nested more than 16 deep"),
    ({"do": within([{"x": "x + " + "+".join(["y"] * 20)}], 3, loop=64)}, "repeat less"),
    (
        {
            "map": ["f30(x)", "y", "z"],
            "functions": {"f0(u)": "u*u"} | {f"f{i + 1}(u)": f"f{i}(u) + f{i}(u)" for i in range(30)},
        },
        "is too large with",
    ),
    ({"map": ["x", "y", "z"], "state": {f"s{i}": 0 for i in range(17)}}, "at most 16 numbers"),
]


@pytest.mark.parametrize(("changes", "message"), LIMITS)
def test_limits(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(FormulaError, match=message):
        chain_of({**XYZ, **changes})


def test_hundreds_of_statements_are_written_quickly_enough_to_be_read_back() -> None:
    """What is long is not slow: nothing grows faster than what is written."""
    do: list[dict[str, Any]] = []
    for index in range(300):
        on = f"p{index % 20}"
        do += [
            {"x": f"x*{on} + 0.01*y", "u": "x*x"},
            {"when": f"{on} > 1", "do": [{"y": "y + u"}, {"z": "sin(z)"}], "else": [{"y": "y - u"}]},
        ]
    formula = {**XYZ, "parameters": {f"p{i}": 1 for i in range(20)}, "do": do}
    text = text_of(formula)
    assert function(text, "real_apply_0").count("if (k[") == 300
    assert "if (k[" not in function(text, "real_usual_0")
    assert len(text) < 600_000


def test_constants_that_are_squared_again_and_again_stay_small() -> None:
    do: list[dict[str, Any]] = [{"a": "p + 0.5"}, *({"a": "a*a*0.5"} for _ in range(40)), {"x": "x + a"}]
    chain = chain_of({**XYZ, "parameters": {"p": 0.2}, "do": do})
    assert len(write_formula(chain).text) < 60_000
