"""Random expressions for property tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from hypothesis import strategies as st

from clfractal.formulas.nodes import COMPARISONS, Call, Name, Node, Number

VARIABLES = ("x", "y", "z")
_UNARY = ("abs", "sign", "sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan", "floor")
_BINARY = ("add", "sub", "mul", "atan2", "min", "max")
_OTHER = ("neg", "div", "mod", "pow", "whole_pow", "clamp", "cpow_re", "cpow_im", "where")

Draw = Callable[[st.SearchStrategy[Any]], Any]

numbers = st.floats(0, 1e300, allow_nan=False).map(lambda v: Number(abs(v)))
small_numbers = st.floats(0.25, 4).map(lambda v: Number(round(v, 6)))
variables = st.sampled_from(VARIABLES).map(Name)
coordinates = st.floats(-3, 3, allow_nan=False).map(lambda v: round(v, 9))


@st.composite
def trees(draw: Draw, leaves: st.SearchStrategy[Any], depth: int) -> Node:
    """Expressions of at most `depth` levels of calls."""
    return _tree(draw, leaves, depth)


def _tree(draw: Draw, leaves: st.SearchStrategy[Any], depth: int) -> Node:
    if depth == 0 or draw(st.integers(0, 4)) == 0:
        leaf: Node = draw(leaves)
        return leaf
    function = draw(st.sampled_from((*_UNARY, *_BINARY, *_OTHER)))

    def below() -> Node:
        return _tree(draw, leaves, depth - 1)

    if function in _UNARY:
        return Call(function, (below(),))
    if function in _BINARY:
        return Call(function, (below(), below()))
    # What the parser refuses or folds (a constant zero as divisor, -3 as a call) is tested elsewhere.
    if function == "neg":
        return Call("neg", (draw(variables),))
    if function in ("div", "mod"):
        return Call(function, (below(), draw(variables | small_numbers)))
    if function == "pow":
        return Call("pow", (draw(variables), draw(small_numbers)))
    if function == "whole_pow":
        return Call("pow", (below(), Number(float(draw(st.integers(0, 9))))))
    if function == "clamp":
        return Call("clamp", (below(), below(), below()))
    if function == "where":
        return Call("where", (_condition(draw, leaves, depth - 1), below(), below()))
    exponent = draw(st.integers(0, 9).map(float) | st.sampled_from((0.5, 2.5)))
    return Call(function, (below(), below(), Number(exponent)))


def _condition(draw: Draw, leaves: st.SearchStrategy[Any], depth: int) -> Node:
    function = draw(st.sampled_from((*sorted(COMPARISONS), "and", "or", "not")))
    if depth > 0 and function == "not":
        return Call("not", (_condition(draw, leaves, depth - 1),))
    if depth > 0 and function in ("and", "or"):
        return Call(function, (_condition(draw, leaves, depth - 1), _condition(draw, leaves, depth - 1)))
    comparison = function if function in COMPARISONS else "lt"
    return Call(comparison, (_tree(draw, leaves, max(depth, 0)), _tree(draw, leaves, max(depth, 0))))


any_tree = trees(variables | numbers, 5)
tame_tree = trees(variables | small_numbers, 3)
