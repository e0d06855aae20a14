"""The syntax tree of a formula's expressions: three kinds of node, and the functions they may call."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeAlias


@dataclass(frozen=True, slots=True)
class Number:
    """A finite constant; `position` is its column in the text, from 1 (0: not from a text)."""

    value: float
    position: int = field(compare=False, default=0)


@dataclass(frozen=True, slots=True)
class Name:
    """A variable, a parameter, a `let` name, or one with a meaning of its own (`point_x`, `dr`, `added`)."""

    name: str
    position: int = field(compare=False, default=0)


@dataclass(frozen=True, slots=True)
class Call:
    """A function or an operator (`add sub mul div pow neg`, `lt le gt ge eq ne`, `and or not`) applied."""

    function: str
    arguments: tuple[Node, ...]
    position: int = field(compare=False, default=0)


Node: TypeAlias = Number | Name | Call

# What may be written as a call, with the number of arguments in the tree. `min` and `max` of more than two
# are folded into calls with two by the parser.
FUNCTIONS = MappingProxyType(
    {
        **dict.fromkeys(
            ("abs", "sign", "sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "atan"), 1
        ),
        **dict.fromkeys(("floor",), 1),
        **dict.fromkeys(("atan2", "min", "max", "mod"), 2),
        **dict.fromkeys(("clamp", "where", "cpow_re", "cpow_im"), 3),
    }
)
# Allowed where only parameters are (repeat, degree, bounds, bailout, ...).
PARAMETER_FUNCTIONS = MappingProxyType({**FUNCTIONS, "log2": 1})
ARITHMETIC = MappingProxyType({"add": "+", "sub": "-", "mul": "*", "div": "/", "pow": "**"})
COMPARISONS = MappingProxyType({"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="})
LOGIC = MappingProxyType({"and": 2, "or": 2, "not": 1})


def is_condition(node: Node) -> bool:
    """Whether the node is a truth value rather than a number."""
    return isinstance(node, Call) and (node.function in COMPARISONS or node.function in LOGIC)


def walk(node: Node) -> Iterator[Node]:
    """The node and everything below it, without recursion."""
    pending = [node]
    while pending:
        here = pending.pop()
        yield here
        if isinstance(here, Call):
            pending.extend(reversed(here.arguments))


def tree_depth(node: Node) -> int:
    """The number of levels of the tree, counted without recursion."""
    depth, level = 0, [node]
    while level:
        depth += 1
        level = [argument for here in level if isinstance(here, Call) for argument in here.arguments]
    return depth


def names_in(node: Node) -> frozenset[str]:
    """Every name used in the tree."""
    found, pending = set(), [node]
    # (As `walk`: writing a formula asks for them a thousand times.)
    while pending:
        here = pending.pop()
        if isinstance(here, Name):
            found.add(here.name)
        elif isinstance(here, Call):
            pending += here.arguments
    return frozenset(found)


def substitute(node: Node, replacements: dict[str, Node]) -> Node:
    """The tree with names replaced by other trees."""
    if isinstance(node, Name):
        return replacements.get(node.name, node)
    if isinstance(node, Call):
        return Call(node.function, tuple(substitute(a, replacements) for a in node.arguments), node.position)
    return node


def to_text(node: Node) -> str:
    """The tree as an expression that parses to an equal tree (every operator in brackets)."""
    if isinstance(node, Number):
        return repr(float(node.value)) if node.value >= 0 else f"(-{-float(node.value)!r})"
    if isinstance(node, Name):
        return node.name
    texts = [to_text(argument) for argument in node.arguments]
    symbol = {**ARITHMETIC, **COMPARISONS, "and": "and", "or": "or"}.get(node.function)
    if symbol is not None:
        return f"({texts[0]} {symbol} {texts[1]})"
    if node.function == "neg":
        return f"(-{texts[0]})"
    if node.function == "not":
        return f"(not {texts[0]})"
    return f"{node.function}({', '.join(texts)})"
