"""Operations on the values of a fragment's code."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NoReturn

from clfractal.errors import FileError, Where
from clfractal.exchange.arithmetic import Arithmetic
from clfractal.exchange.glsl_symbols import GlslSymbols, Items, Matrix, is_condition, leaves_of, rebuilt
from clfractal.exchange.glsl_tree import MATRICES, SIZES
from clfractal.exchange.symbols import COMPARISONS, Value


@dataclass
class GlslArithmetic(Arithmetic):
    """Computes with numbers, conditions, vectors and matrices.

    Attributes:
        here: the place in the text.
    """

    symbols: GlslSymbols
    here: Where = field(default_factory=Where, kw_only=True)

    def refuse(self, what: str) -> NoReturn:
        """Raises FileError: the text has no counterpart, at its place."""
        raise FileError(f"{what} is outside of the GLSL that is read", self.here)

    def call(self, name: str, *parts: Value) -> Value:
        if name == "/" and parts[1] == 0.0 and parts[0] != 0.0:
            raise FileError("a division by 0", self.here)
        found = super().call(name, *parts)
        if isinstance(found, float) and not abs(found) <= 1e30:
            raise FileError("a number that is too large", self.here)
        return found

    def scalar_of(self, value: object) -> Value:
        """A value as a number, or as a condition."""
        if isinstance(value, list | Matrix | Items) or value is None:
            self.refuse("a vector, a matrix, an array or nothing as a number")
        return value  # type: ignore[return-value]

    def vector_of(self, value: object) -> list[Value]:
        if not isinstance(value, list):
            self.refuse("this as a vector")
        return value

    def matrix_of(self, value: object) -> Matrix:
        """A value as a matrix."""
        if not isinstance(value, Matrix):
            self.refuse("this as a matrix")
        return value

    def condition_of(self, value: object) -> Value:
        """A value as a condition."""
        return self.symbols.condition(self.scalar_of(value))

    def is_choice(self, value: object) -> bool:
        """Whether a value is made of conditions."""
        parts = leaves_of(value)
        return bool(parts) and all(is_condition(part) for part in parts)

    def check_sizes(self, values: Sequence[object]) -> None:
        """Refuses vectors of several sizes, and what is no number and no vector."""
        sizes = {len(value) for value in values if isinstance(value, list)}
        if len(sizes) > 1 or any(isinstance(value, Matrix | Items) for value in values):
            self.refuse("these values together")

    def operator(self, name: str, one: object, other: object) -> object:
        if isinstance(one, Matrix) or isinstance(other, Matrix):
            return self.of_matrices(name, one, other)
        if name in ("==", "!="):
            return self.equal(name, one, other)
        self.check_sizes((one, other))
        if name == "%":
            return self.each(self.remainder, one, other)
        if name in ("&", "|", "^", "<<", ">>"):
            self.refuse(f"the operation {name}")
        if name in COMPARISONS and (isinstance(one, list) or isinstance(other, list)):
            self.refuse(f"{name} of vectors")
        return self.each(lambda a, b: self.call(name, a, b), one, other)

    def equal(self, name: str, one: object, other: object) -> Value:
        """`==` and `!=`, of all parts together."""
        parts, others = leaves_of(one), leaves_of(other)
        if len(parts) != len(others):
            self.refuse("these values together")
        found: Value = 1.0
        for a, b in zip(parts, others, strict=True):
            found = self.symbols.both(found, self.call("==", a, b))
        return found if name == "==" else self.symbols.opposite(found)

    def remainder(self, a: Value, b: Value) -> Value:
        """Of whole numbers: the quotient is cut towards 0."""
        if isinstance(a, float) and isinstance(b, float):
            return math.fmod(a, b) if b else self.refuse("a remainder by 0")
        return self.call("-", a, self.call("*", b, self.cut(self.call("/", a, b))))

    def cut(self, a: Value) -> Value:
        """A number without its fraction."""
        if isinstance(a, float):
            return float(math.trunc(a))
        return self.call("*", self.call("sign", a), self.call("floor", self.call("abs", a)))

    # --- matrices

    def of_matrices(self, name: str, one: object, other: object) -> object:
        if name == "*":
            return self.product(one, other)
        if name in ("+", "-", "/") and not isinstance(other, list) and not isinstance(one, list):
            shape = one if isinstance(one, Matrix) else other
            count = len(leaves_of(shape))
            a, b = leaves_of(one), leaves_of(other)
            a, b = (a * count if len(a) == 1 else a), (b * count if len(b) == 1 else b)
            if len(a) != len(b):
                self.refuse("these matrices together")
            return rebuilt(shape, [self.call(name, x, y) for x, y in zip(a, b, strict=True)])
        return self.refuse(f"{name} of a matrix")

    def product(self, one: object, other: object) -> object:
        """A product with a matrix."""
        if isinstance(one, Matrix) and isinstance(other, Matrix):
            if len(one.columns) != len(other.columns):
                self.refuse("matrices of several sizes")
            return Matrix(tuple(tuple(self.times(one, list(column))) for column in other.columns))
        if isinstance(one, Matrix) and isinstance(other, list):
            return self.times(one, other)
        if isinstance(one, list):
            matrix = self.matrix_of(other)
            if len(matrix.columns) != len(one):
                self.refuse("a vector and a matrix of other sizes")
            return [self.dot(one, list(column)) for column in matrix.columns]
        if isinstance(one, Matrix):
            return self.scaled(one, other)
        return self.scaled(self.matrix_of(other), one)

    def scaled(self, matrix: Matrix, factor: object) -> object:
        """A matrix times a number."""
        by = self.scalar_of(factor)
        return rebuilt(matrix, [self.call("*", by, part) for part in leaves_of(matrix)])

    def times(self, matrix: Matrix, vector: list[Value]) -> list[Value]:
        """A matrix times a column."""
        if len(matrix.columns) != len(vector):
            self.refuse("a vector and a matrix of other sizes")
        return [self.dot(matrix.row(place), vector) for place in range(len(vector))]

    def grown(self, matrix: Matrix, size: int) -> Matrix:
        """A matrix of another size; what is not there is that of the unit matrix."""
        old = len(matrix.columns)
        return Matrix(
            tuple(
                tuple(matrix.columns[i][j] if i < old and j < old else float(i == j) for j in range(size))
                for i in range(size)
            )
        )

    # --- types

    def made(self, kind: str, values: Sequence[object]) -> object:
        """The value of a type's constructor, as `vec3(p.xy, 1.0)`."""
        if kind in MATRICES:
            return self.matrix_made(MATRICES[kind], values)
        size = SIZES[kind]
        parts = [part for value in values for part in leaves_of(value)]
        if not parts or any(isinstance(value, Items) or value is None for value in values):
            self.refuse(f"{kind} of nothing")
        if len(parts) == 1:
            parts = parts * size
        if len(parts) < size or (
            len(parts) > size and len(values) > 1 and len(parts) - len(leaves_of(values[-1])) >= size
        ):
            self.refuse(f"{kind} of {len(parts)} numbers")
        converted = [self.converted(kind, part) for part in parts[:size]]
        return converted[0] if size == 1 else converted

    def converted(self, kind: str, part: Value) -> Value:
        """A number as a part of a type's values."""
        if kind.startswith("b"):
            return self.symbols.condition(part)
        plain = self.plain(part)
        return (
            self.cut(plain)
            if kind.startswith(("int", "uint", "ivec", "uvec")) and not _whole(plain)
            else plain
        )

    def matrix_made(self, size: int, values: Sequence[object]) -> object:
        if len(values) == 1 and isinstance(values[0], Matrix):
            return self.grown(values[0], size)
        parts = [self.plain(part) for value in values for part in leaves_of(value)]
        if len(parts) == 1:
            return Matrix(tuple(tuple(parts[0] if i == j else 0.0 for j in range(size)) for i in range(size)))
        if len(parts) != size * size:
            self.refuse(f"a matrix of {len(parts)} numbers")
        return Matrix(tuple(tuple(parts[size * i : size * (i + 1)]) for i in range(size)))

    def empty(self, kind: str, size: int) -> object:
        """What a variable is before it has a value."""
        if size:
            return Items(tuple(self.empty(kind, 0) for _ in range(size)))
        if kind in MATRICES:
            return Matrix(((0.0,) * MATRICES[kind],) * MATRICES[kind])
        if kind not in SIZES:
            self.refuse(f"a variable of type {kind}")
        return [0.0] * SIZES[kind] if SIZES[kind] > 1 else 0.0

    def fits(self, kind: str, size: int, value: object) -> bool:
        """Whether a value is one of a type."""
        if size:
            return isinstance(value, Items) and len(value.values) == size
        if kind in MATRICES:
            return isinstance(value, Matrix) and len(value.columns) == MATRICES[kind]
        wanted = SIZES.get(kind, 1)
        return (
            len(value) == wanted
            if isinstance(value, list)
            else wanted == 1 and not isinstance(value, Matrix | Items)
        )

    def mixed(self, condition: Value, yes: object, no: object) -> object:
        """What is there after two ways to go."""
        if yes is no or yes is None or no is None:
            return no if yes is None else yes
        parts, others = leaves_of(yes), leaves_of(no)
        if len(parts) != len(others):
            return yes
        found = []
        for a, b in zip(parts, others, strict=True):
            if is_condition(a) or is_condition(b):
                found.append(
                    self.symbols.picked(condition, self.symbols.condition(a), self.symbols.condition(b))
                )
            else:
                found.append(self.symbols.choose(condition, a, b))
        return rebuilt(yes, found)


def _whole(value: Value) -> bool:
    return isinstance(value, float) and value.is_integer()
