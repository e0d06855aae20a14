"""Values of a fragment's code: numbers and conditions as expressions, vectors, matrices, arrays of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from clfractal.exchange.symbols import (
    CONDITIONS,
    FUNCTIONS,
    Symbol,
    Symbols,
    Value,
    ordered,
)


@dataclass(frozen=True, slots=True, eq=False)
class Matrix:
    """A matrix by its columns, as the language has it."""

    columns: tuple[tuple[Value, ...], ...]

    def row(self, place: int) -> list[Value]:
        """One of its rows."""
        return [column[place] for column in self.columns]


@dataclass(frozen=True, slots=True, eq=False)
class Items:
    """An array."""

    values: tuple[object, ...]


class GlslSymbols(Symbols):
    """Expressions, with choices that are the larger or the smaller of two numbers told as such."""

    def choose(self, condition: Value, yes: Value, no: Value) -> Value:
        if isinstance(condition, Symbol) and condition.operation == "not":
            return self.choose(condition.parts[0], no, yes)
        if isinstance(condition, Symbol) and condition.operation in ("<", "<=", ">", ">="):
            one, other = condition.parts
            smaller = condition.operation in ("<", "<=")
            if _same(yes, one) and _same(no, other):
                return self.call("min" if smaller else "max", one, other)
            if _same(yes, other) and _same(no, one):
                return self.call("max" if smaller else "min", one, other)
        return super().choose(condition, yes, no)

    def both(self, one: Value, other: Value) -> Value:
        return one if _same(one, other) else super().both(one, other)

    def either(self, one: Value, other: Value) -> Value:
        """`or`, of two conditions."""
        if isinstance(one, float):
            return 1.0 if one else other
        if isinstance(other, float):
            return 1.0 if other else one
        return one if one is other else self._made("or", (one, other))

    def picked(self, condition: Value, yes: Value, no: Value) -> Value:
        """Of two conditions the one that holds where another does."""
        if isinstance(condition, float) or _same(yes, no):
            return yes if condition == 1.0 or _same(yes, no) else no
        return self.either(self.both(condition, yes), self.both(self.opposite(condition), no))


def _same(one: Value, other: Value) -> bool:
    return one is other or (isinstance(one, float) and isinstance(other, float) and one == other)


def is_condition(value: object) -> bool:
    """Whether a value is true or false, not a number."""
    return isinstance(value, Symbol) and value.operation in CONDITIONS


def leaves_of(value: object) -> list[Value]:
    """The numbers of a vector, a matrix or an array, in order."""
    if isinstance(value, list):
        return list(value)
    if isinstance(value, Matrix):
        return [part for column in value.columns for part in column]
    if isinstance(value, Items):
        return [leaf for part in value.values for leaf in leaves_of(part)]
    return [value] if isinstance(value, float | Symbol) else []


def rebuilt(value: object, leaves: Sequence[Value]) -> object:
    """A value of the same kind, of other numbers."""
    given = iter(leaves)

    def build(part: object) -> object:
        if isinstance(part, list):
            return [next(given) for _ in part]
        if isinstance(part, Matrix):
            return Matrix(tuple(tuple(next(given) for _ in column) for column in part.columns))
        if isinstance(part, Items):
            return Items(tuple(build(each) for each in part.values))
        return next(given) if isinstance(part, float | Symbol) else part

    return build(value)


def replaced(
    symbols: Symbols,
    values: Sequence[Value],
    names: Mapping[str, Value],
    parts: Mapping[int, Value] | None = None,
) -> list[Value]:
    """Values with others in the place of some names, and of some parts, which are told by their `id`."""
    others = parts or {}
    done: dict[int, Value] = {}

    def get(part: Value) -> Value:
        return part if isinstance(part, float) else done[id(part)]

    for symbol in ordered(values):
        inner = tuple(get(part) for part in symbol.parts)
        if id(symbol) in others:
            done[id(symbol)] = others[id(symbol)]
        elif symbol.operation == "name":
            done[id(symbol)] = names.get(symbol.name, symbol)
        elif all(_same(a, b) for a, b in zip(inner, symbol.parts, strict=True)):
            done[id(symbol)] = symbol
        else:
            done[id(symbol)] = _again(symbols, symbol.operation, inner)
    return [get(value) for value in values]


def _again(symbols: Symbols, operation: str, parts: tuple[Value, ...]) -> Value:
    if operation == "neg":
        return symbols.negative(parts[0])
    if operation == "not":
        return symbols.opposite(parts[0])
    if operation == "where":
        return symbols.choose(*parts)
    if operation == "and":
        return symbols.both(*parts)
    if operation == "or" and isinstance(symbols, GlslSymbols):
        return symbols.either(*parts)
    return symbols.call(operation, *parts)


_LOGIC: Mapping[str, Callable[..., float]] = {
    "neg": lambda a: -a,
    "not": lambda a: float(not a),
    "and": lambda a, b: float(bool(a) and bool(b)),
    "or": lambda a, b: float(bool(a) or bool(b)),
    "where": lambda c, a, b: a if c else b,
}


def numbers_of(values: Sequence[Value], names: Mapping[str, float]) -> list[float]:
    """The numbers that values are for values of all their names; not a number where there is none."""
    done: dict[int, float] = {}
    for symbol in ordered(values):
        parts = [part if isinstance(part, float) else done[id(part)] for part in symbol.parts]
        if symbol.operation == "name":
            done[id(symbol)] = names[symbol.name]
            continue
        try:
            function = _LOGIC.get(symbol.operation) or FUNCTIONS[symbol.operation]
            done[id(symbol)] = function(*parts)
        except (ArithmeticError, ValueError, TypeError):
            done[id(symbol)] = math.nan
    return [value if isinstance(value, float) else done[id(value)] for value in values]
