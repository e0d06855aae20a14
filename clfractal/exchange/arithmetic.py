"""Operations on what a formula's text computes with: numbers and vectors, known or symbols."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NoReturn

from clfractal.errors import FileError, Where
from clfractal.exchange.symbols import COMPARISONS, Symbols, Value

Vector = list[Value]


class Nothing:
    """A value that only distances or colours need."""


NOTHING = Nothing()


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A number of a vector, which a pointer leads to."""

    vector: list[object]
    index: int


class Turn(float):
    """The number of an application, which texts compare with their parameters."""


@dataclass
class Arithmetic:
    """Computes with the values of one text.

    Attributes:
        line: where it stands.
        compared: the numbers that the application's number was compared with.
        computed: whether it was used in another way, too.
    """

    file: str
    symbols: Symbols
    line: int
    compared: set[float] = field(default_factory=set, kw_only=True)
    computed: bool = field(default=False, kw_only=True)

    def refuse(self, what: str) -> NoReturn:
        """Raises FileError: the text has no counterpart, at its line."""
        raise FileError(f"has no counterpart: {what}", Where(self.file, self.line or None))

    def merged(self, condition: Value | Nothing, yes: object, no: object) -> object:
        """What is there after two ways to go."""
        if isinstance(yes, list) and isinstance(no, list) and len(yes) == len(no):
            return [self.merged(condition, a, b) for a, b in zip(yes, no, strict=True)]
        if isinstance(yes, Nothing) or isinstance(no, Nothing):
            return NOTHING
        if isinstance(yes, Place) or isinstance(no, Place):
            self.refuse("a pointer that depends on z")
        if isinstance(condition, Nothing):
            return yes if yes is no or (isinstance(yes, float) and yes == no) else NOTHING
        return self.symbols.choose(condition, self.scalar_of(yes), self.scalar_of(no))

    def operator(self, name: str, one: object, other: object) -> object:
        if name == "&" and other == 1.0:  # the last bit
            return self.each(
                lambda a: self.call("-", a, self.call("*", 2.0, self.call("floor", self.call("*", 0.5, a)))),
                one,
            )
        if name in ("%", "&", "|") and isinstance(one, float) and isinstance(other, float):
            a, b = int(one), int(other)
            if name == "%":
                return float(math.fmod(a, b)) if b else self.refuse("a remainder by 0")
            return float(a & b) if name == "&" else float(a | b)
        if name not in ("+", "-", "*", "/", *COMPARISONS):
            self.refuse(f"the operation {name}")
        return self.each(lambda a, b: self.call(name, a, b), one, other)

    def call(self, name: str, *parts: Value) -> Value:
        """An operation on numbers; a condition among them counts as 1 or 0."""
        for part, other in zip(parts, reversed(parts), strict=True):
            if isinstance(part, Turn):
                if name in COMPARISONS and isinstance(other, float):
                    self.compared.add(float(other))
                else:
                    self.computed = True
        try:
            return self.symbols.call(name, *(self.plain(part) for part in parts))
        except (ArithmeticError, ValueError):
            return self.refuse(f"{name} of numbers that have no such value")

    def plain(self, part: Value) -> Value:
        """A condition as a number."""
        if isinstance(part, float) or self.symbols.condition(part) is not part:
            return part
        return self.symbols.choose(part, 1.0, 0.0)

    def each(self, function: Callable[..., Value], *values: object) -> object:
        """A function of numbers, for each component where values are vectors."""
        if any(isinstance(value, Nothing) for value in values):
            return NOTHING
        sizes = [len(value) for value in values if isinstance(value, list)]
        if not sizes:
            return function(*(self.scalar_of(value) for value in values))
        size = min(sizes)
        columns = [value[:size] if isinstance(value, list) else [value] * size for value in values]
        return [function(*(self.scalar_of(part) for part in parts)) for parts in zip(*columns, strict=True)]

    def scalar_of(self, value: object) -> Value:
        """A value as a number."""
        if isinstance(value, Nothing):
            self.refuse("z depends on distances or colours")
        if isinstance(value, list | Place):
            self.refuse("a vector or a pointer as a number")
        assert not isinstance(value, tuple)
        return value  # type: ignore[return-value]

    def vector_of(self, value: object) -> Vector:
        """A value as a vector."""
        if not isinstance(value, list):
            self.refuse("a number as a vector")
        return [self.scalar_of(part) for part in value]

    def rows_of(self, value: object) -> list[Vector]:
        """A value as the three rows of a matrix."""
        if not isinstance(value, list) or len(value) != 3:
            self.refuse("this as a matrix")
        return [self.vector_of(row) for row in value]

    @property
    def nothing(self) -> Nothing:
        """What only distances or colours need."""
        return NOTHING

    def is_nothing(self, value: object) -> bool:
        """Whether a value is that."""
        return isinstance(value, Nothing)

    def dot(self, one: object, other: object) -> Value:
        """The product of two vectors."""
        found: Value = 0.0
        for a, b in zip(self.vector_of(one), self.vector_of(other), strict=False):
            found = self.call("+", found, self.call("*", a, b))
        return found

    def length(self, vector: object) -> Value:
        """The length of a vector, or of a number."""
        if not isinstance(vector, list):
            return self.call("abs", self.scalar_of(vector))
        return self.call("sqrt", self.dot(vector, vector))
