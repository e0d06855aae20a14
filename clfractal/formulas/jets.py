"""Jets over mpmath: values in any precision, with first and second derivatives by some numbers, in float64.

An orbit's values need all digits; how it spreads beside them needs none but the first. The rules are those of Taylor
arithmetic (Griewank and Walther, Evaluating Derivatives, 2nd ed., SIAM 2008, ch. 13) up to the second order. A backend
also keeps how far from the place, by the first order, a formula goes another way: at a condition, a fold, or a pole.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from clfractal.formulas.backends import MpmathBackend
from clfractal.formulas.evaluate import MAX_EXPONENT, TINY, power_by_squaring, whole

Parts: TypeAlias = NDArray[np.float64]
_COMPARED = frozenset(("lt", "le", "gt", "ge", "eq", "ne"))


@dataclass(frozen=True, slots=True)
class Jet:
    """A number near a place.

    Attributes:
        value: an mpf.
        slope: its first derivatives.
        bend: its second ones, those above the matrix's diagonal and on it, row by row.
    """

    value: Any
    slope: Parts
    bend: Parts


def constant_jet(value: Any, variables: int = 3) -> Jet:
    """A number that is the same everywhere."""
    return Jet(value, np.zeros(variables), np.zeros(len(_corner(variables)[0])))


def variable_jet(value: Any, number: int, *, unit: float = 1.0, variables: int = 3) -> Jet:
    """One of the variables, of which one unit counts as so much."""
    jet = constant_jet(value, variables)
    jet.slope[number] = unit
    return jet


def full_bend(jet: Jet) -> Parts:
    """The second derivatives as a symmetric matrix."""
    variables = len(jet.slope)
    rows, columns = _corner(variables)
    matrix = np.zeros((variables, variables))
    matrix[rows, columns] = jet.bend
    matrix[columns, rows] = jet.bend
    return matrix


@lru_cache
def _corner(variables: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    rows, columns = np.triu_indices(variables)
    return rows, columns


def _crossed(a: Any, b: Any) -> Any:
    """a_i b_j + a_j b_i."""
    rows, columns = _corner(len(a))
    return a[rows] * b[columns] + a[columns] * b[rows]


class JetBackend:
    """Jets, in mpmath's current precision. Numbers that are none are constants.

    Attributes:
        reach: how far all went the same way, in units of the coordinates; an infinity where nothing chooses.
    """

    def __init__(self, variables: int = 3) -> None:
        self.variables = variables
        self.plain = MpmathBackend()
        self.reach = math.inf
        self._own: Mapping[str, Callable[..., Any]] = {
            "add": lambda a, b: Jet(a.value + b.value, a.slope + b.slope, a.bend + b.bend),
            "sub": lambda a, b: Jet(a.value - b.value, a.slope - b.slope, a.bend - b.bend),
            "mul": self._times,
            "div": self._over,
            "neg": lambda a: Jet(-a.value, -a.slope, -a.bend),
            "abs": lambda a: a if self._ahead(a) else Jet(-a.value, -a.slope, -a.bend),
            "sign": self._sign,
            "floor": self._floor,
            "mod": lambda a, b: self._own["sub"](
                a, self._times(b, self._constant(self._floor(self._over(a, b))))
            ),
            "min": lambda a, b: a if self._ahead(self._own["sub"](b, a)) else b,
            "max": lambda a, b: a if self._ahead(self._own["sub"](a, b)) else b,
            "clamp": lambda a, low, high: self._own["min"](self._own["max"](a, low), high),
            "pow": self._power,
            "cpow_re": lambda x, y, n: self._complex_power(x, y, n)[0],
            "cpow_im": lambda x, y, n: self._complex_power(x, y, n)[1],
            "atan2": self._angle,
        }

    def call(self, function: str, arguments: list[Any]) -> Any:
        """The function's value: a jet, a number where nothing varies, or a bool."""
        if not any(isinstance(each, Jet) for each in arguments):
            return self.plain.call(function, arguments)
        if function in _COMPARED:
            a, b = map(self.lifted, arguments)
            difference: Jet = self._own["sub"](a, b)
            self._turns(difference)
            return self.plain.call(function, [a.value, b.value])
        if function in ("pow", "cpow_re", "cpow_im"):
            *base, exponent = arguments
            return self._own[function](*map(self.lifted, base), exponent)
        jets = [self.lifted(each) for each in arguments]
        own = self._own.get(function)
        return own(*jets) if own is not None else self._unary(function, jets[0])

    def _constant(self, value: Any) -> Jet:
        return constant_jet(value, self.variables)

    def lifted(self, value: Any) -> Jet:
        """A number as a jet."""
        return value if isinstance(value, Jet) else self._constant(self.plain.mp.mpf(value))

    # --- where ways part ---

    def _turns(self, jet: Jet) -> None:
        """Something else happens where this is 0."""
        slope = float(np.linalg.norm(jet.slope))
        if slope > 0:
            self.reach = min(self.reach, float(abs(jet.value) / slope) / 2)

    def _ahead(self, jet: Jet) -> bool:
        self._turns(jet)
        return bool(jet.value >= 0)

    def _sign(self, a: Jet) -> Any:
        self._turns(a)
        return self.plain.call("sign", [a.value])

    def _floor(self, a: Jet) -> Any:
        below = self.plain.call("floor", [a.value])
        self._turns(Jet(a.value - below, a.slope, a.bend))
        self._turns(Jet(a.value - below - 1, a.slope, a.bend))
        return below

    # --- smooth operations ---

    def _times(self, a: Jet, b: Jet) -> Jet:
        u, v = float(a.value), float(b.value)
        bend = u * b.bend + v * a.bend + _crossed(a.slope, b.slope)
        return Jet(a.value * b.value, u * b.slope + v * a.slope, bend)

    def _over(self, a: Jet, b: Jet) -> Jet:
        self._turns(b)
        value = self.plain.call("div", [a.value, b.value])
        q, v = float(value), float(b.value)
        # a = q b: the product's rule, solved for q.
        with np.errstate(all="ignore"):
            slope = (a.slope - q * b.slope) / v
            return Jet(value, slope, (a.bend - q * b.bend - _crossed(slope, b.slope)) / v)

    def _chain(self, a: Jet, value: Any, first: float, second: float) -> Jet:
        """f(a), by f' and f''."""
        return Jet(value, first * a.slope, first * a.bend + second / 2 * _crossed(a.slope, a.slope))

    def _unary(self, function: str, a: Jet) -> Jet:
        value = self.plain.call(function, [a.value])
        x, y = float(a.value), float(value)
        if function in ("sqrt", "log"):
            self._turns(a)
            if x <= (0.0 if function == "sqrt" else TINY):
                return self._constant(value)
        if function in ("asin", "acos"):
            for edge in (1, -1):
                self._turns(Jet(a.value - edge, a.slope, a.bend))
            if abs(x) >= 1:
                return self._constant(value)
        return self._chain(a, value, *_SLOPES[function](x, y))

    def _angle(self, y: Jet, x: Jet) -> Jet:
        """atan2: of log(x + iy) the imaginary part."""
        value = self.plain.call("atan2", [y.value, x.value])
        w = complex(float(x.value), float(y.value))
        self._around(w, x, y)
        if w == 0:
            return self._constant(value)
        # (The half line behind 0 is no kink of what orbits make of angles, but of the angle itself.)
        if w.real < 0:
            self._turns(y)
        slope = (x.slope + 1j * y.slope) / w
        bend = (x.bend + 1j * y.bend) / w - _crossed(slope, slope) / 2
        return Jet(value, slope.imag, bend.imag)

    def _around(self, w: complex, x: Jet, y: Jet) -> None:
        """Something else happens where x + iy is 0."""
        slope = math.sqrt(float(x.slope @ x.slope + y.slope @ y.slope))
        if slope > 0:
            self.reach = min(self.reach, abs(w) / slope / 2)

    def _power(self, a: Jet, n: Any) -> Jet:
        exponent = whole(n)
        if exponent is not None and abs(exponent) <= MAX_EXPONENT:
            power: Jet = power_by_squaring(a, abs(exponent), self._times, self._constant(self.plain.mp.one))
            return power if exponent >= 0 else self._over(self._constant(self.plain.mp.one), power)
        if isinstance(n, Jet):
            return self._unary("exp", self._times(n, self._unary("log", a)))
        value = self.plain.call("pow", [a.value, n])
        self._turns(a)
        x, y, e = float(a.value), float(value), float(n)
        if x <= 0:
            return self._constant(value)
        return self._chain(a, value, e * y / x, e * (e - 1) * y / x / x)

    def _complex_power(self, x: Jet, y: Jet, n: Any) -> tuple[Jet, Jet]:
        re = self.plain.call("cpow_re", [x.value, y.value, n])
        im = self.plain.call("cpow_im", [x.value, y.value, n])
        w, f, e = complex(float(x.value), float(y.value)), complex(float(re), float(im)), float(n)
        first: complex
        second: complex
        if e != 1 and not (e > 0 and e == math.floor(e)):
            self._around(w, x, y)
        slope, bend = x.slope + 1j * y.slope, x.bend + 1j * y.bend
        if w == 0:
            # Of whole powers 1 and 2 alone something is left here.
            first, second = (1.0 if e == 1 else 0.0), (2.0 if e == 2 else 0.0)
        else:
            first, second = e * f / w, e * (e - 1) * f / w / w
        slope, bend = first * slope, first * bend + second / 2 * _crossed(slope, slope)
        return Jet(re, slope.real, bend.real), Jet(im, slope.imag, bend.imag)


# f' and f'' of functions of one number, by it and by f.
_SLOPES: Mapping[str, Callable[[float, float], tuple[float, float]]] = {
    "sqrt": lambda x, y: (0.5 / y, -0.25 / (x * y)),
    "exp": lambda x, y: (y, y),
    "log": lambda x, y: (1 / x, -1 / (x * x)),
    "sin": lambda x, y: (math.cos(x), -y),
    "cos": lambda x, y: (-math.sin(x), -y),
    "tan": lambda x, y: (1 + y * y, 2 * y * (1 + y * y)),
    "atan": lambda x, y: (1 / (1 + x * x), -2 * x / (1 + x * x) ** 2),
    "asin": lambda x, y: ((1 - x * x) ** -0.5, x * (1 - x * x) ** -1.5),
    "acos": lambda x, y: (-((1 - x * x) ** -0.5), -x * (1 - x * x) ** -1.5),
}
