"""Expressions that are made step by step, simplified as they are made, and written in our formula language.

Equal expressions are one object, so that what is used several times becomes one name of `let`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

MAX_NAMES = 100
MAX_EXPRESSION = 1500
MAX_DEPTH = 60
MAX_NODES = 20_000
INFINITE = 1e30


@dataclass(frozen=True, slots=True, eq=False)
class Symbol:
    """An operation on other values; `name` is a variable's for `operation` "name"."""

    operation: str
    parts: tuple[Value, ...]
    name: str = ""


Value = float | Symbol

FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "abs": abs,
    "sign": lambda x: float((x > 0) - (x < 0)),
    "sqrt": lambda x: math.sqrt(max(x, 0.0)),
    "exp": math.exp,
    "log": lambda x: math.log(max(x, 2.0**-126)),
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": lambda x: math.asin(min(max(x, -1.0), 1.0)),
    "acos": lambda x: math.acos(min(max(x, -1.0), 1.0)),
    "atan": math.atan,
    "atan2": math.atan2,
    "floor": lambda x: float(math.floor(x)),
    "min": min,
    "max": max,
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    # C gives an infinity; what is so large goes away from every set as well.
    "/": lambda a, b: a / b if b else math.copysign(INFINITE, a) if a else 0.0,
    "**": lambda a, b: float(a**b),
    "<": lambda a, b: float(a < b),
    "<=": lambda a, b: float(a <= b),
    ">": lambda a, b: float(a > b),
    ">=": lambda a, b: float(a >= b),
    "==": lambda a, b: float(a == b),
    "!=": lambda a, b: float(a != b),
}
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")
CONDITIONS = (*COMPARISONS, "and", "or", "not")
_RANK = {
    "or": 1,
    "and": 2,
    "not": 3,
    **dict.fromkeys(COMPARISONS, 4),
    "+": 5,
    "-": 5,
    "*": 6,
    "/": 6,
    "neg": 7,
    "**": 8,
}


_ALMOST_NOTHING = 1e-30


class TooLargeError(Exception):
    """An expression is larger than our language takes."""


@dataclass
class Symbols:
    """Makes expressions. Numbers are folded, and what adds, multiplies or chooses nothing is left out."""

    known: dict[tuple[object, ...], Symbol] = field(default_factory=dict)

    def name(self, name: str) -> Symbol:
        """A variable, or another name of the language."""
        return self._made("name", (), name)

    def call(self, operation: str, *parts: Value) -> Value:
        """An operation or a function of the language.

        Raises:
            TooLargeError: there are too many of them.
            ArithmeticError, ValueError: of numbers that have no such value.
        """
        if all(isinstance(part, float) for part in parts) and operation in FUNCTIONS:
            return float(FUNCTIONS[operation](*parts))
        if operation == "/" and parts[1] == 0.0:
            # Texts count on infinity, of which our language has none; what is divided by that is 0 in both.
            parts = (parts[0], _ALMOST_NOTHING)
        simple = self._simple(operation, parts)
        return self._made(operation, parts) if simple is None else simple

    def negative(self, part: Value) -> Value:
        """-part."""
        if isinstance(part, float):
            return -part
        if part.operation == "neg":
            return part.parts[0]
        if part.operation == "*" and isinstance(part.parts[0], float):
            return self.call("*", -part.parts[0], part.parts[1])
        return self._made("neg", (part,))

    def choose(self, condition: Value, yes: Value, no: Value) -> Value:
        """`where`."""
        if isinstance(condition, float):
            return yes if condition else no
        return yes if yes is no or yes == no else self._made("where", (condition, yes, no))

    def both(self, one: Value, other: Value) -> Value:
        """`and`, of two conditions."""
        if isinstance(one, float):
            return other if one else 0.0
        if isinstance(other, float):
            return one if other else 0.0
        return self._made("and", (one, other))

    def opposite(self, condition: Value) -> Value:
        """`not`."""
        if isinstance(condition, float):
            return float(not condition)
        return condition.parts[0] if condition.operation == "not" else self._made("not", (condition,))

    def condition(self, value: Value) -> Value:
        """A value as a condition: whether it is not 0."""
        if isinstance(value, float) or value.operation in CONDITIONS:
            return value
        return self.call("!=", value, 0.0)

    def _simple(self, operation: str, parts: tuple[Value, ...]) -> Value | None:
        if len(parts) != 2:
            return None
        one, other = parts
        if operation == "+":
            if isinstance(other, Symbol) and other.operation == "neg":
                return self.call("-", one, other.parts[0])
            return other if one == 0.0 else one if other == 0.0 else None
        if operation == "-":
            if isinstance(other, Symbol) and other.operation == "neg":
                return self.call("+", one, other.parts[0])
            return (
                one if other == 0.0 else self.negative(other) if one == 0.0 else 0.0 if one is other else None
            )
        if operation == "*":
            if 0.0 in (one, other):
                return 0.0
            if isinstance(other, float):
                return self.call("*", other, one)
            if one in (1.0, -1.0):
                return other if one == 1.0 else self.negative(other)
            if isinstance(one, float) and other.operation == "*" and isinstance(other.parts[0], float):
                return self.call("*", one * other.parts[0], other.parts[1])
            return None
        if operation == "/":
            return (
                0.0
                if one == 0.0
                else self.call("*", 1 / other, one)
                if isinstance(other, float) and other
                else None
            )
        if operation == "**":
            return one if other == 1.0 else 1.0 if other == 0.0 else None
        return None

    def _made(self, operation: str, parts: tuple[Value, ...], name: str = "") -> Symbol:
        key = (operation, name, *(part if isinstance(part, float) else (id(part),) for part in parts))
        found = self.known.get(key)
        if found is None:
            if len(self.known) >= MAX_NODES:
                raise TooLargeError("it has too many operations")
            found = self.known[key] = Symbol(operation, parts, name)
        return found


def names_in(values: Sequence[Value]) -> set[str]:
    """The variables that values depend on."""
    found: set[str] = set()
    for symbol in ordered(values):
        if symbol.operation == "name":
            found.add(symbol.name)
    return found


def written(
    values: Sequence[Value], prefix: str, most: int = MAX_NAMES, long: int = MAX_EXPRESSION
) -> tuple[dict[str, str], list[str]]:
    """Values as text: the entries of `let`, and an expression for each value.

    Args:
        prefix: what names of `let` begin with.
        most: how many of them there may be.
        long: from which size on a condition that is asked several times has a name, as 1 or 0.

    Raises:
        TooLargeError: they need more names, or larger expressions, than the language takes.
    """
    order = ordered(values)
    uses: dict[int, int] = {}
    for symbol in order:
        for part in symbol.parts:
            uses[id(part)] = uses.get(id(part), 0) + 1
    for value in values:
        uses[id(value)] = uses.get(id(value), 0) + 1
    texts: dict[int, tuple[str, int, int, int]] = {}  # text, rank, size, depth
    let: dict[str, str] = {}
    for symbol in order:
        text, rank, size, depth = _text(symbol, texts)
        shared = uses[id(symbol)] > 1 and symbol.operation not in ("name", *CONDITIONS)
        if (shared and size > 2) or (depth > MAX_DEPTH and symbol.operation not in CONDITIONS):
            name = f"{prefix}{len(let) + 1}"
            let[name] = text
            text, rank, size, depth = name, 9, 1, 1
        if symbol.operation in CONDITIONS and uses[id(symbol)] > 1 and size > long:
            name = f"{prefix}{len(let) + 1}"
            let[name] = f"where({text}, 1, 0)"
            text, rank, size, depth = f"{name} > 0.5", _RANK[">"], 3, 2
        if size > MAX_EXPRESSION:
            raise TooLargeError("an expression is too long")
        texts[id(symbol)] = (text, rank, size, depth)
    if len(let) > most:
        raise TooLargeError(f"it needs {len(let)} names for parts of the map; {most} are allowed")
    return let, [texts[id(value)][0] if isinstance(value, Symbol) else number(value) for value in values]


def number(value: float) -> str:
    """The shortest text of a number, negative ones with their sign."""
    return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)


def ordered(values: Sequence[Value]) -> list[Symbol]:
    """All symbols below, each once, parts before what is made of them."""
    found: list[Symbol] = []
    done: set[int] = set()
    stack: list[tuple[Value, bool]] = [(value, False) for value in reversed(values)]
    while stack:
        value, ready = stack.pop()
        if isinstance(value, float) or id(value) in done:
            continue
        if ready:
            done.add(id(value))
            found.append(value)
        else:
            stack.append((value, True))
            stack += [(part, False) for part in reversed(value.parts)]
    return found


def _text(symbol: Symbol, texts: Mapping[int, tuple[str, int, int, int]]) -> tuple[str, int, int, int]:
    if symbol.operation == "name":
        return symbol.name, 9, 1, 1
    parts = [
        (number(part), 9 if part >= 0 else 7, 1, 1) if isinstance(part, float) else texts[id(part)]
        for part in symbol.parts
    ]
    size, depth = 1 + sum(part[2] for part in parts), 1 + max(part[3] for part in parts)
    rank = _RANK.get(symbol.operation)
    if rank is None:
        return f"{symbol.operation}({', '.join(part[0] for part in parts)})", 9, size, depth
    if symbol.operation in ("neg", "not"):
        sign = "-" if symbol.operation == "neg" else "not "
        return sign + _in(parts[0], rank), rank, size, depth
    # Left to right for all but powers; comparisons are not chained.
    left = rank + 1 if symbol.operation == "**" or symbol.operation in COMPARISONS else rank
    right = rank if symbol.operation in ("and", "or") else rank + 1
    space = " " if rank <= 5 else ""
    second = _in(parts[1], right)
    if symbol.operation == "+" and second.startswith("-"):
        return f"{_in(parts[0], left)} - {second[1:]}", rank, size, depth
    text = f"{_in(parts[0], left)}{space}{symbol.operation}{space}{second}"
    return text, rank, size, depth


def _in(part: tuple[str, int, int, int], least: int) -> str:
    return part[0] if part[1] >= least else f"({part[0]})"
