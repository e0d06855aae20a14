"""Exact values of operations at floats: mpmath numbers, or floats for infinities and NaN.

They are total, as `real.h` says: where mathematics has no value there is a chosen one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import mpmath

mpf = mpmath.mpf
NAN, INF = math.nan, math.inf

# An exact number as mpmath's, or what stands for it: an infinity or NaN as a float.
Exact = Any


def sign(a: float) -> float:
    return float((a > 0) - (a < 0))


def finite(*arguments: float) -> bool:
    return all(math.isfinite(a) for a in arguments)


def exactly(operation: Callable[..., Any]) -> Callable[..., Exact]:
    """Exact for finite numbers; IEEE's value (Python's) for the others."""

    def evaluate(*arguments: float) -> Exact:
        return operation(*map(mpf, arguments)) if finite(*arguments) else operation(*arguments)

    return evaluate


def divide(a: float, b: float) -> Exact:
    if b == 0:
        return NAN if a == 0 or math.isnan(a) else math.copysign(INF, a) * math.copysign(1.0, b)
    return mpf(a) / mpf(b) if finite(a, b) else a / b


def minimum(a: float, b: float) -> float:
    """The number where one of the two is NaN, like C's fmin."""
    return b if math.isnan(a) else a if math.isnan(b) else min(a, b)


def maximum(a: float, b: float) -> float:
    return b if math.isnan(a) else a if math.isnan(b) else max(a, b)


def modulo(a: float, b: float) -> Exact:
    """a - b*floor(a/b), as IEEE arithmetic has it where a number or the quotient is not finite."""
    quotient = divide(a, b)
    if not finite(a, b) or not mpmath.isfinite(quotient):
        turns = math.floor(quotient) if mpmath.isfinite(quotient) else quotient
        return a - b * turns
    return mpf(a) - mpf(b) * mpmath.floor(quotient)


def mod_choices(
    a: float, b: float, smallest: float, largest: float
) -> Sequence[tuple[Exact, Sequence[Exact]]]:
    """Values and slopes for other roundings of the quotient.

    It may become the whole number beside it (4 units cover division's 2.5), 0 or infinite.
    """
    quotient = divide(a, b)
    if not finite(a, b) or not mpmath.isfinite(quotient):
        return []
    if abs(quotient) > largest / 2:
        return [(value, (1, NAN)) for value in (NAN, INF, -INF)]
    wobble = abs(quotient) * mpf(2) ** -21 + smallest
    wholes = {mpmath.floor(quotient - wobble), mpmath.floor(quotient + wobble)}
    return [(mpf(a) - mpf(b) * turns, (1, -turns)) for turns in wholes]


def total(function: Callable[[Any], Any], at_plus: float, at_minus: float) -> Callable[[float], Exact]:
    """A function with its limits at the infinities; NaN stays NaN."""

    def evaluate(a: float) -> Exact:
        if math.isfinite(a):
            return function(mpf(a))
        return a if math.isnan(a) else at_plus if a > 0 else at_minus

    return evaluate


def power(x: float, y: float) -> Exact:
    """C's pow (C99, F.9.4.4), with 0 in place of NaN."""
    if y == 0 or x == 1:
        return mpf(1)
    if math.isnan(x) or math.isnan(y):
        return mpf(0)
    whole = math.isinf(y) or y == math.floor(y)
    if math.isinf(y):
        if abs(x) == 1:
            return mpf(1)
        return mpf(0) if (abs(x) < 1) == (y > 0) else INF
    odd = whole and math.fmod(y, 2) != 0
    negative = odd and math.copysign(1.0, x) < 0
    if x == 0 or math.isinf(x):
        size: Exact = mpf(0) if (x == 0) == (y > 0) else INF
    elif x < 0 and not whole:
        return mpf(0)
    else:
        exponent = mpf(y) * mpmath.log(abs(mpf(x)))
        size = INF if exponent > 2000 else mpf(0) if exponent < -2000 else mpmath.exp(exponent)
    return -size if negative else size


def log_smallest(smallest: float) -> Callable[[float], Exact]:
    """log of at least the smallest number that it takes."""
    return lambda a: INF if a == INF else mpmath.log(mpf(a) if a > smallest else mpf(smallest))


def atan2(y: float, x: float) -> Exact:
    """0 at the origin; mpmath has no negative zeros, so the branch cut is told here."""
    if math.isnan(x) or math.isnan(y):
        return NAN
    if x == 0 and y == 0:
        return mpf(0)
    if finite(x, y):
        if y == 0 and x < 0:
            return math.copysign(1.0, y) * mpmath.pi
        return mpmath.atan2(mpf(y), mpf(x))
    ends = [sign(v) if math.isinf(v) else math.copysign(0.0, v) for v in (y, x)]
    return mpmath.pi * (round(4 * math.atan2(*ends) / math.pi) / mpf(4))


def clamp(a: float, low: float, high: float) -> float:
    return minimum(maximum(a, low), high)


def within_one(a: float) -> float:
    return clamp(a, -1.0, 1.0)


def finite_or_zero(a: Exact, largest: float) -> Exact:
    return a if mpmath.isfinite(a) and abs(a) <= largest else mpf(0)


def arc_slope(a: float) -> Exact:
    """1/sqrt(1 - a^2) within (-1, 1), else 0."""
    return 1 / mpmath.sqrt((1 - mpf(a)) * (1 + mpf(a))) if abs(a) < 1 else mpf(0)


def normalized(a: float, b: float, c: float) -> Exact:
    """The first component of a vector made one long; 0 for a vector that is zero or not finite."""
    if not finite(a, b, c) or a == b == c == 0:
        return mpf(0)
    return mpf(a) / mpmath.sqrt(mpf(a) ** 2 + mpf(b) ** 2 + mpf(c) ** 2)
