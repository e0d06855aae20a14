"""How far a computed number is from an exact one, in units in the last place."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import mpmath
import numpy as np

from clfractal.device.structs import Precision
from tests.numbers.exact import Exact
from tests.numbers.operations import Operation, lifted

# Sizes at which the partials of duals are checked: squares and quotients of such numbers are in range.
_TAME: dict[Precision, tuple[float, float]] = {"float32": (1e-9, 1e9), "float64": (1e-70, 1e70)}


@dataclass(frozen=True)
class Range:
    """The numbers of a precision."""

    precision: Precision
    smallest: float
    largest: float
    digits: int

    @staticmethod
    def of(precision: Precision) -> Range:
        info = np.finfo(precision)
        return Range(precision, float(info.tiny), float(info.max), int(info.nmant))

    @property
    def flushed(self) -> float:
        """A size whose unit is the smallest normal number: products below may have become 0."""
        return math.ldexp(self.smallest, self.digits)

    def unit(self, size: Exact) -> Exact:
        """The distance of neighbouring numbers at a size; float32 may flush denormal ones."""
        if abs(size) < self.smallest:
            return mpmath.mpf(self.smallest) * (
                1 if self.precision == "float32" else mpmath.mpf(2) ** -self.digits
            )
        exponent = math.frexp(min(float(abs(size)), 1e308))[1]  # faster than mpmath's logarithm
        return math.ldexp(1.0, exponent - 1 - self.digits)

    def error(self, got: float, exact: Exact, size: Exact | None = None) -> float:
        """Units of `size` (of `exact` if not given) between `got` and `exact`."""
        if not mpmath.isfinite(exact):
            same = math.isnan(got) if mpmath.isnan(exact) else got == exact
            return 0.0 if same else math.inf
        if got == exact:
            return 0.0
        if math.isnan(got):
            return math.inf
        measured = exact if size is None else size
        if math.isinf(
            got
        ):  # as good as the largest; SLEEF calls exp infinite from 709.78271115 on, 1.8e-6 too early
            return 0.0 if abs(exact) > self.largest * (1 - 2e-6) or abs(measured) > self.largest else math.inf
        if abs(exact) > self.largest:
            exact = mpmath.sign(exact) * self.largest
        if self.precision == "float32" and max(abs(got), abs(exact)) < self.smallest:
            return 0.0  # denormal numbers may be zero, or not
        return float(abs(mpmath.mpf(got) - exact) / self.unit(measured))

    def tame(self, arguments: Sequence[float]) -> bool:
        low, high = _TAME[self.precision]
        return all(a == 0 or low <= abs(a) <= high for a in arguments)

    def readings(self, arguments: Sequence[float]) -> list[tuple[float, ...]]:
        """The arguments, and with float32's denormal numbers read as zeros: both are allowed."""
        if self.precision == "float64":
            return [tuple(arguments)]
        each = [(a, math.copysign(0.0, a)) if 0 < abs(a) < self.smallest else (a,) for a in arguments]
        return list(itertools.product(*each))


def value_fault(operation: Operation, numbers: Range, arguments: Sequence[float], got: float) -> str:
    """What is wrong with the value that an operation gave, or ''."""
    place = int(numbers.precision == "float64")
    if operation.loose(*arguments) and not math.isnan(got):
        return ""
    best = math.inf
    for reading in numbers.readings(arguments):
        exact = [operation.value(*reading)]
        if operation.choices is not None:
            exact += [value for value, _ in operation.choices(*reading)]
        finite = all(math.isfinite(a) for a in reading)
        size = operation.unit(*reading) if operation.unit is not None and finite else None
        allowed = operation.ulps[place]
        for each in exact:
            error = numbers.error(got, each, size)
            if error <= allowed:
                return ""
            best = min(best, error)
    return f"{operation.name}{tuple(arguments)} = {got!r}, off by {best:.3g} units (allowed {allowed:.3g})"


def partial_fault(
    operation: Operation,
    call: str,
    numbers: Range,
    arguments: Sequence[float],
    inputs: Sequence[Sequence[float]],
    got: float,
    axis: int,
) -> str:
    """What is wrong with the partial by an axis that a call over duals gave, or ''.

    `inputs[i][axis]` are the partials of argument i. Arguments that are not tame are tested for values only.
    """
    assert operation.slopes is not None
    if not numbers.tame(arguments):
        return ""
    candidates = [operation.slopes(*arguments)]
    if operation.choices is not None:
        candidates += [slopes for _, slopes in operation.choices(*arguments)]
    fault = ""
    for slopes in candidates:
        fault = _slope_fault(operation, call, numbers, arguments, inputs, got, axis, slopes)
        if not fault:
            return ""
    return fault


def _slope_fault(
    operation: Operation,
    call: str,
    numbers: Range,
    arguments: Sequence[float],
    inputs: Sequence[Sequence[float]],
    got: float,
    axis: int,
    slopes: Sequence[Exact],
) -> str:
    # An ulp is between half and all of epsilon, so that a chain of roundings may count double.
    allowed = 2 * operation.slope_ulps(*arguments) + 2
    used = [index for index in lifted(call) if index < len(slopes)]
    terms = [mpmath.mpf(slopes[index]) * inputs[index][axis] for index in used]
    if not all(
        mpmath.isfinite(s) and abs(s) < numbers.largest / 8 for s in (*terms, *(slopes[i] for i in used))
    ):
        return ""
    exact = sum(terms, mpmath.mpf(operation.added[axis]))
    size = sum(map(abs, terms), mpmath.mpf(operation.added[axis]))
    size = max(size, numbers.flushed)
    error = numbers.error(got, exact, size)
    if error <= allowed:
        return ""
    return (
        f"{call} at {tuple(arguments)}: partial {'xyz'[axis]} = {got!r}, exact {mpmath.nstr(exact, 12)}, "
        f"off by {error:.3g} units (allowed {allowed:.3g})"
    )
