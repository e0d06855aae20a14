"""A formula's automatic Jacobian beside central differences, both in mpmath with many digits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

import mpmath

from clfractal.formulas.backends import DualBackend, MpmathBackend, constant_dual, seeded
from clfractal.formulas.definition import BoundFormula
from clfractal.formulas.reference import apply

DIGITS = 60
STEP = "1e-20"
"""An error of some 1e-40 times the third derivative, and as much by rounding."""
AGREED = 1e-12
"""Largest relative difference of partials that agree: constants of formulas are doubles, and so are their reciprocals."""
REACH = 2.0
"""Coordinates of places go from minus this to this."""
TRIES = 40
"""How often a place is drawn anew."""

_Numbers = Sequence[Any]


@dataclass
class Slopes:
    """What was found at some places.

    Attributes:
        places: where partials were compared.
        anew: places that were drawn anew because a case changes within the step ...
        endless: ... or because values there are no finite numbers.
        largest: the largest difference of a partial, over the largest one of its row.
        where: the number, and what it was differentiated by, of that one.
    """

    places: int = 0
    anew: int = 0
    endless: int = 0
    largest: float = 0.0
    where: str = ""


class Cases(MpmathBackend):
    """mpmath numbers that keep which case of each function they were: what a fold, a turn or a condition chose."""

    def __init__(self) -> None:
        super().__init__()
        self.cases: list[object] = []

    def call(self, function: str, arguments: list[Any]) -> Any:
        """As of every backend."""
        value = super().call(function, arguments)
        case = _CASES.get(function)
        if case is not None:
            self.cases.append(case(arguments, value))
        return value


def _side(number: Any) -> int:
    return int(number > 0) - int(number < 0)


def _cut(y: Any, x: Any) -> object:
    """Across the negative x axis angles jump."""
    return _side(y) if x <= 0 else 1


_CASES: Mapping[str, Callable[[_Numbers, Any], object]] = {
    **dict.fromkeys(("lt", "le", "gt", "ge", "eq", "ne"), lambda a, value: value),
    **dict.fromkeys(("abs", "sign", "sqrt"), lambda a, value: _side(a[0])),
    **dict.fromkeys(("asin", "acos"), lambda a, value: abs(a[0]) < 1),
    **dict.fromkeys(("cpow_re", "cpow_im"), lambda a, value: a[2] == int(a[2]) or _cut(a[1], a[0])),
    "log": lambda a, value: a[0] > 1e-30,
    "pow": lambda a, value: a[1] == mpmath.floor(a[1]) or _side(a[0]),
    "floor": lambda a, value: value,
    "mod": lambda a, value: mpmath.floor(a[0] / a[1]) if a[1] else 0,
    "min": lambda a, value: _side(a[0] - a[1]),
    "max": lambda a, value: _side(a[0] - a[1]),
    "clamp": lambda a, value: (_side(a[0] - a[1]), _side(a[0] - a[2])),
    "atan2": lambda a, value: _cut(a[0], a[1]),
}


def slopes_of(bound: BoundFormula, number: int, chance: Random, places: int, into: Slopes) -> None:
    """Compares the partials of what an application makes of z, of what is carried, and of the point, by all of these.

    Args:
        number: of the application.
        chance: where places are drawn from.
        into: what is found is added to it.
    """
    with mpmath.workdps(DIGITS):
        for _ in range(places):
            for _ in range(TRIES):
                start = [drawn(chance) for _ in names_of(bound)]
                found = _at(bound, number, start)
                if isinstance(found, tuple):
                    into.places += 1
                    if found[0] > into.largest:
                        into.largest, into.where = found
                    break
                if found:
                    into.anew += 1
                else:
                    into.endless += 1


def drawn(chance: Random) -> Any:
    """A coordinate of a place."""
    return mpmath.mpf(chance.uniform(-REACH, REACH))


def names_of(bound: BoundFormula) -> list[str]:
    """What an application depends on: z, what is carried, and the point."""
    formula = bound.formula
    return [
        *formula.variables,
        *(each.name for each in formula.state),
        *(f"point_{name}" for name in formula.variables),
    ]


def _applied(bound: BoundFormula, number: int, start: _Numbers, backend: Any) -> list[Any]:
    size = len(bound.formula.variables)
    point = list(bound.julia) if bound.julia is not None else start[-size:]
    return apply(bound, start[:-size], point, backend, number=number)


def _at(bound: BoundFormula, number: int, start: _Numbers) -> tuple[float, str] | bool:
    """The largest difference, and where; else whether a case changes there (else values are not finite)."""
    size = len(start)
    ways = [[int(place == by) for place in range(size)] for by in range(size)]
    slopes = differences(bound, number, start, ways)
    if isinstance(slopes, bool):
        return slopes
    duals = _applied(bound, number, seeded(list(start)), DualBackend(MpmathBackend()))
    largest, where = 0.0, ""
    names = names_of(bound)
    for name, each, other in zip(names, duals, slopes, strict=False):
        row = constant_dual(each, size).partials
        if not all(map(mpmath.isfinite, row)):
            return False
        for by, a, b, difference in zip(names, row, other, relative(row, other), strict=True):
            if difference > largest:
                largest, where = difference, f"d {name} / d {by}: {mpmath.nstr(a, 8)}, {mpmath.nstr(b, 8)}"
    return largest, where


def relative(row: _Numbers, other: _Numbers) -> list[float]:
    """The differences of two rows, over the largest number of both."""
    # (What differences see of a slope of 0 is rounding.)
    most = max(*map(abs, row), *map(abs, other), mpmath.mpf("1e-20"))
    return [float(abs(a - b) / most) for a, b in zip(row, other, strict=True)]


def differences(
    bound: BoundFormula, number: int, start: _Numbers, ways: Sequence[_Numbers]
) -> list[list[Any]] | bool:
    """How an application's results change along ways, a list for each; else as `_at`."""
    backend = Cases()
    here = _applied(bound, number, start, backend)
    if not all(map(mpmath.isfinite, here)):
        return False
    step = mpmath.mpf(STEP)
    slopes: list[list[Any]] = [[] for _ in here]
    for way in ways:
        ends = []
        for sign in (-1, 1):
            beside = Cases()
            moved = [part + sign * step * along for part, along in zip(start, way, strict=True)]
            ends.append(_applied(bound, number, moved, beside))
            if beside.cases != backend.cases:
                return True
        for row, low, high in zip(slopes, *ends, strict=True):
            row.append((high - low) / (2 * step))
    return slopes if all(map(mpmath.isfinite, (each for row in slopes for each in row))) else False
