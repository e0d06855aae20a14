"""Operands of what is written in OpenCL C, and powers of them that are made of products."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from clfractal.formulas.nodes import Node, Number


@dataclass(frozen=True, slots=True)
class Value:
    """An operand: C text, and what it is. `number` is set for literals, `node` for constants of either sort."""

    text: str
    kind: Literal["constant", "flat", "varying"]
    node: Node | None = None
    number: float | None = None


def literal(value: float) -> Value:
    """A number known when the text is written."""
    return Value(f"R({float(value)!r})", "constant", Number(value), float(value))


class Operation(Protocol):
    """Writes one operation, and gives its value."""

    def __call__(self, function: str, *operands: Value) -> Value: ...


def whole_power(do: Operation, base: Value, n: int) -> Value:
    """base ** n for a whole n of 1 or more, by repeated squaring."""
    if n == 1:
        return base
    half = whole_power(do, base, n // 2)
    square = do("mul", half, half)
    return do("mul", square, base) if n % 2 else square


def whole_complex_power(do: Operation, x: Value, y: Value, n: int) -> tuple[Value, Value]:
    """(x + iy) ** n in the same way."""
    if n == 1:
        return x, y
    re, im = whole_complex_power(do, x, y, n // 2)
    # (re + im)(re - im) cancels less than re^2 - im^2.
    real_part = do("mul", do("add", re, im), do("sub", re, im))
    product = do("mul", re, im)
    imaginary = do("add", product, product)
    if n % 2 == 0:
        return real_part, imaginary
    return (
        do("sub", do("mul", real_part, x), do("mul", imaginary, y)),
        do("add", do("mul", real_part, y), do("mul", imaginary, x)),
    )


def power_over_root(do: Operation, x: Value, square: Value, n: int) -> tuple[Value, Value]:
    """(x + i sqrt(square))^n as (re, s) with imaginary part s * sqrt(square), so that nothing waits for the root."""
    if n == 1:
        return x, literal(1.0)
    re, s = power_over_root(do, x, square, n // 2)
    squared = do("sub", do("mul", re, re), do("mul", square, do("mul", s, s)))
    product = do("mul", re, s)
    doubled = do("add", product, product)
    if n % 2 == 0:
        return squared, doubled
    return (
        do("sub", do("mul", squared, x), do("mul", square, doubled)),
        do("add", do("mul", doubled, x), squared),
    )
