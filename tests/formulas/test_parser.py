"""What an expression may be: everything in the language parses, everything else is one located error."""

from __future__ import annotations

import math
import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.errors import FormulaError, Where
from clfractal.formulas.language import Call, Name, Node, Number, parse, to_text
from tests.calls import failure
from tests.formulas.trees import any_tree

X, Y = Name("x"), Name("y")


def tree(text: str | int | float) -> Node:
    return parse(text, names=["x", "y", "z"], where=Where(path="map.0"))


def wrong(text: object) -> FormulaError:
    error = failure(FormulaError, parse, text, names=["x", "y", "z"], where=Where(path="map.0"))
    assert error.where.path == "map.0"
    return error


def assert_parses_or_fails_cleanly(text: str) -> None:
    error = None
    try:
        tree(text)
    except FormulaError as caught:
        error = caught
    if error is not None:
        assert "\n" not in str(error)
        assert (error.status, error.where.path) == (2, "map.0")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x + y*2", Call("add", (X, Call("mul", (Y, Number(2.0)))))),
        ("-x**2", Call("neg", (Call("pow", (X, Number(2.0))),))),
        ("+x", X),
        ("-3", Number(-3.0)),
        ("pi", Number(math.pi)),
        ("1e-3", Number(0.001)),
        (4, Number(4.0)),
        (-0.5, Number(-0.5)),
        ("min(x, y, 1)", Call("min", (Call("min", (X, Y)), Number(1.0)))),
        (
            "where(0 < x < y, x, y)",
            Call("where", (Call("and", (Call("lt", (Number(0.0), X)), Call("lt", (X, Y)))), X, Y)),
        ),
        (
            "where(not x > 0 or y == 1, x, y)",
            Call(
                "where",
                (
                    Call("or", (Call("not", (Call("gt", (X, Number(0.0))),)), Call("eq", (Y, Number(1.0))))),
                    X,
                    Y,
                ),
            ),
        ),
        ("  x\n + y ", Call("add", (X, Y))),
    ],
)
def test_expressions_become_trees(text: str | int | float, expected: Node) -> None:
    assert tree(text) == expected


@given(any_tree)
def test_a_printed_tree_parses_to_itself(node: Node) -> None:
    assert tree(to_text(node)) == node


@given(st.text(max_size=60) | st.text(alphabet=string.printable, max_size=60))
def test_random_text_raises_only_formula_errors(text: str) -> None:
    assert_parses_or_fails_cleanly(text)


_PIECES = [
    "x",
    "y",
    "q",
    "(",
    ")",
    "+",
    "-",
    "*",
    "/",
    "**",
    "0",
    "1e9",
    "sin",
    "where",
    "<",
    ",",
    "not",
    "and",
    " ",
    "if",
]


@given(st.lists(st.sampled_from(_PIECES), max_size=40).map(" ".join))
def test_random_tokens_raise_only_formula_errors(text: str) -> None:
    assert_parses_or_fails_cleanly(text)


@pytest.mark.parametrize(
    ("text", "words", "column"),
    [
        ("(" * 10_000, "nested more than 100 levels", 101),
        ("(" * 4000 + "x" + ")" * 4000, "nested more than 100 levels", 101),
        ("-" * 9000 + "x", "nested more than 100 levels", 1),
        ("not " * 2000 + "x", "nested more than 100 levels", None),
        ("x**" * 3000 + "x", "nested more than 100 levels", None),
        ("+".join("x" * 4000), "nested more than 100 levels", None),
        ("min(" + ", ".join("x" * 600) + ")", "nested more than 100 levels", 1),
        ("max(" + ", ".join(["x*x*x*x*x*x*x*x"] * 99) + ") + " + "+".join(["x*y"] * 90), "", None),
        ("x" * 10_001, "too long", None),
        ("x + foo", "unknown name 'foo'", 5),
        ("x + Y", "did you mean 'y'?", 5),
        ("sinn(x)", "did you mean 'sin'?", 1),
        ("log2(x)", "unknown function 'log2'", 1),
        ("sin", "is a function", 1),
        ("x(2)", "is not a function", 1),
        ("2(3)", "only a function's name can be called", 1),
        ("sin(x, y)", "sin takes 1 argument, got 2", 1),
        ("atan2(x)", "atan2 takes 2 arguments, got 1", 1),
        ("min(x)", "min takes at least 2 arguments, got 1", 1),
        ("sin(*x)", "plain arguments only", 1),
        ("sin(x=1)", "plain arguments only", 1),
        ("x/0", "division by zero", 3),
        ("x/(1 - 1)", "division by zero", 4),
        ("mod(x, 0)", "division by zero", 8),
        ("0**-1", "division by zero", None),
        ("x**100000", "an exponent must be at most 1000", 4),
        ("x**10**10", "an exponent must be at most 1000", 4),
        ("cpow_re(x, y, -5000)", "an exponent must be at most 1000", 15),
        ("1e400", "finite", 1),
        ("9" * 400, "finite", 1),
        ("9" * 5000, "too many digits", 1),
        ("1j", "an imaginary number", 1),
        ("True", "got true", 1),
        ("None", "got nothing", 1),
        ("...", "a number or a name is needed", 1),
        ("x < 1", "must be a number, not a condition", 1),
        ("x + (x < 1)", "needs a number here, not a condition", 6),
        ("where(x, 1, 2)", "where needs a condition", 7),
        ("where(x > 0 and 1, 1, 2)", "'and' needs a condition", 17),
        ("where(x > 0, y > 0, 2)", "where needs a number", 14),
        ("x if x > 0 else y", "use where", 1),
        ("x is y", "comparison", 1),
        ("x in y", "comparison", 1),
        ("x // y", "use floor", 1),
        ("x.real", "attributes", 1),
        ("x.__class__", "attributes", 1),
        ("x, y", "a single value", 1),
        ("(yield)", "not part of the language", 2),
        ("await x", "not part of the language", 1),
        ("lambda: 1", "unexpected character ':'", 7),
        ("(x := 1)", "unexpected character ':'", 4),
        ("x[0]", "unexpected character '['", 2),
        ("'a'", 'unexpected character "\'"', 1),
        ("{x}", "unexpected character '{'", 1),
        ("x # y", "unexpected character '#'", 3),
        ("x % y", "unexpected character '%'", 3),
        ("x ^ y", "unexpected character '^'; a power is written x**2", 3),
        ("2x*y", "invalid decimal literal; a product is written 2*x", 1),
        ("\uff58", "unexpected character", 1),
        ("x y", "cannot be read", 3),
        ("x +", "cannot be read", None),
        ("x) + (y", "cannot be read", None),
        ("", "is empty", None),
        ("  ", "is empty", None),
    ],
)
def test_everything_else_is_one_located_line(text: str, words: str, column: int | None) -> None:
    error = wrong(text)
    assert words in error.message
    if column is not None:
        assert error.where.column == column
        assert f"at column {column} of " in error.message
    assert len(error.message) < 250


@pytest.mark.parametrize("text", ["x2 y", "2e3 +* x", "x1y +", "1.5e-3 y"])
def test_a_product_is_not_suggested_where_none_is_meant(text: str) -> None:
    assert "2*x" not in wrong(text).message


@pytest.mark.parametrize(
    "value", [True, False, None, [1], {"a": 1}, 1j, math.nan, math.inf, 10**400, b"x", object()]
)
def test_values_that_are_no_expression(value: object) -> None:
    wrong(value)


def test_log2_is_for_parameters() -> None:
    node = parse("log2(power)", names=["power"], where=Where(), parameters_only=True)
    assert node == Call("log2", (Name("power"),))


def test_positions_are_columns_of_the_text() -> None:
    node = tree("  x*foo".replace("foo", "y"))
    assert isinstance(node, Call)
    assert [argument.position for argument in node.arguments] == [3, 5]
