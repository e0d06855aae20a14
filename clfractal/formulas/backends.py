"""Kinds of number that a tree can be evaluated with: NumPy arrays, mpmath, and duals of both.

All follow the conventions of `evaluate.py`. Duals carry partial derivatives forward (Griewank and Walther,
Evaluating Derivatives, 2nd ed., SIAM 2008, ch. 3); at a kink or a pole of a derivative the partial is
one-sided or 0, never NaN because of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from clfractal.formulas.evaluate import (
    MAX_EXPONENT,
    TINY,
    Backend,
    call_any,
    complex_multiply,
    power_by_squaring,
    whole,
)


class NumpyBackend:
    """float64 arrays, element by element; truth values are boolean arrays. Use it under `np.errstate`."""

    def call(self, function: str, arguments: list[Any]) -> Any:
        """The function's value as an array."""
        return _NUMPY_FUNCTIONS[function](*arguments)


def _numpy_power(x: Any, n: Any) -> Any:
    exponent = whole(n)
    if exponent is not None and abs(exponent) <= MAX_EXPONENT:
        power = power_by_squaring(x, abs(exponent), lambda a, b: a * b, np.ones_like(x))
        return power if exponent >= 0 else 1.0 / power
    power = np.power(np.asarray(x, dtype=float), n)
    return np.where(np.isnan(power) & ~(np.isnan(x) | np.isnan(n)), 0.0, power)


def _numpy_complex_power(x: Any, y: Any, n: float) -> tuple[Any, Any]:
    x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    if n == 0:
        return np.ones_like(x), np.zeros_like(x)
    origin = (x == 0) & (y == 0)
    exponent = whole(n)
    if exponent is not None and abs(exponent) <= MAX_EXPONENT:
        re, im = power_by_squaring((x, y), abs(exponent), complex_multiply, (1.0, 0.0))
        if exponent < 0:
            size = re * re + im * im
            re, im = np.where(origin, 0.0, re / size), np.where(origin, 0.0, -im / size)
        return re, im
    radius, angle = np.where(origin, 0.0, np.hypot(x, y) ** n), n * np.arctan2(y, x)
    return radius * np.cos(angle), radius * np.sin(angle)


_NUMPY_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "pow": _numpy_power,
    "cpow_re": lambda x, y, n: _numpy_complex_power(x, y, n)[0],
    "cpow_im": lambda x, y, n: _numpy_complex_power(x, y, n)[1],
    "neg": np.negative,
    "lt": np.less,
    "le": np.less_equal,
    "gt": np.greater,
    "ge": np.greater_equal,
    "eq": np.equal,
    "ne": np.not_equal,
    "and": np.logical_and,
    "or": np.logical_or,
    "not": np.logical_not,
    "abs": np.abs,
    "sign": np.sign,
    "sqrt": lambda a: np.sqrt(np.maximum(a, 0.0)),
    "exp": np.exp,
    "log": lambda a: np.log(np.maximum(a, TINY)),
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": lambda a: np.arcsin(np.clip(a, -1.0, 1.0)),
    "acos": lambda a: np.arccos(np.clip(a, -1.0, 1.0)),
    "atan": np.arctan,
    "atan2": lambda y, x: np.where((x == 0) & (y == 0), 0.0, np.arctan2(y, x)),
    "min": lambda a, b: np.where(np.less_equal(a, b), a, b),
    "max": lambda a, b: np.where(np.greater_equal(a, b), a, b),
    "clamp": lambda a, low, high: np.minimum(np.maximum(a, low), high),
    "floor": np.floor,
    "mod": lambda a, b: a - b * np.floor(np.divide(a, b)),
    "where": np.where,
}


class MpmathBackend:
    """mpmath numbers in mpmath's current precision; truth values are Python bools."""

    def __init__(self) -> None:
        import mpmath  # an optional dependency: only high-precision readers need it

        self.mp = mpmath.mp
        mp = self.mp
        one = mp.mpf(1)
        self.functions: Mapping[str, Callable[..., Any]] = {
            "add": lambda a, b: a + b,
            "sub": lambda a, b: a - b,
            "mul": lambda a, b: a * b,
            "div": self._divide,
            "pow": self._pow,
            "cpow_re": lambda x, y, n: self._cpow(x, y, n)[0],
            "cpow_im": lambda x, y, n: self._cpow(x, y, n)[1],
            "neg": lambda a: -a,
            "lt": lambda a, b: bool(a < b),
            "le": lambda a, b: bool(a <= b),
            "gt": lambda a, b: bool(a > b),
            "ge": lambda a, b: bool(a >= b),
            "eq": lambda a, b: bool(a == b),
            "ne": lambda a, b: bool(a != b),
            "and": lambda a, b: a and b,
            "or": lambda a, b: a or b,
            "not": lambda a: not a,
            "abs": abs,
            "sign": mp.sign,
            "sqrt": lambda a: mp.sqrt(a) if a > 0 else mp.zero,
            "exp": mp.exp,
            "log": lambda a: mp.log(max(a, TINY)),
            "sin": self._trig(mp.sin),
            "cos": self._trig(mp.cos),
            "tan": self._trig(mp.tan),
            "asin": lambda a: mp.asin(min(max(a, -one), one)),
            "acos": lambda a: mp.acos(min(max(a, -one), one)),
            "atan": mp.atan,
            "atan2": lambda y, x: mp.zero if x == 0 and y == 0 else mp.atan2(y, x),
            "min": lambda a, b: a if a <= b else b,
            "max": lambda a, b: a if a >= b else b,
            "clamp": lambda a, low, high: min(max(a, low), high),
            "floor": mp.floor,
            "mod": lambda a, b: a - b * mp.floor(self._divide(a, b)),
            "where": lambda condition, a, b: a if condition else b,
        }

    def call(self, function: str, arguments: list[Any]) -> Any:
        """The function's value as an mpf."""
        return self.functions[function](*arguments)

    def _divide(self, a: Any, b: Any) -> Any:
        if b != 0:
            return self.mp.mpf(a) / b
        return self.mp.nan if a == 0 or self.mp.isnan(a) else self.mp.inf * self.mp.sign(a)

    def _trig(self, function: Callable[[Any], Any]) -> Callable[[Any], Any]:
        return lambda a: function(a) if self.mp.isfinite(a) else self.mp.nan

    def _pow(self, x: Any, n: Any) -> Any:
        exponent = whole(n)
        if exponent is not None and abs(exponent) <= MAX_EXPONENT:
            power = power_by_squaring(x, abs(exponent), lambda a, b: a * b, self.mp.one)
            return power if exponent >= 0 else self._divide(self.mp.one, power)
        if x > 0:
            return self.mp.exp(n * self.mp.log(x))
        if x < 0:
            sign = -1 if self.mp.floor(n) % 2 else 1
            return sign * self.mp.exp(n * self.mp.log(-x)) if n == self.mp.floor(n) else self.mp.zero
        return self.mp.zero if n > 0 else self.mp.one if n == 0 else self.mp.inf

    def _cpow(self, x: Any, y: Any, n: float) -> tuple[Any, Any]:
        if n == 0:
            return self.mp.one, self.mp.zero
        if x == 0 and y == 0:
            return self.mp.zero, self.mp.zero
        exponent = whole(n)
        if exponent is not None and abs(exponent) <= MAX_EXPONENT:
            re, im = power_by_squaring((x, y), abs(exponent), complex_multiply, (1, 0))
            size = re * re + im * im
            return (re, im) if exponent > 0 else (self._divide(re, size), self._divide(-im, size))
        radius, angle = self._pow(self.mp.hypot(x, y), n), n * self.mp.atan2(y, x)
        return radius * self.mp.cos(angle), radius * self.mp.sin(angle)


@dataclass(frozen=True, slots=True)
class Dual:
    """A number of some backend and its partial derivatives."""

    value: Any
    partials: tuple[Any, ...]


class DualBackend:
    """Duals over another backend. An argument that is no Dual is constant and costs no partials."""

    def __init__(self, base: Backend) -> None:
        self.base = base
        do, guarded = self._base, self._guarded
        # The derivatives by each argument, of the arguments' values and the function's own.
        self._slopes: Mapping[str, Callable[[list[Any], Any], tuple[Any, ...]]] = {
            "add": lambda v, value: (1.0, 1.0),
            "sub": lambda v, value: (1.0, -1.0),
            "mul": lambda v, value: (v[1], v[0]),
            "div": lambda v, value: (do("div", 1.0, v[1]), do("neg", do("div", value, v[1]))),
            "pow": lambda v, value: (
                self._finite(do("mul", v[1], do("pow", v[0], do("sub", v[1], 1.0)))),
                self._finite(do("mul", value, do("log", v[0]))),
            ),
            "neg": lambda v, value: (-1.0,),
            "abs": lambda v, value: (do("sign", v[0]),),
            "sqrt": lambda v, value: (guarded(do("gt", v[0], 0.0), lambda: do("div", 0.5, value)),),
            "exp": lambda v, value: (value,),
            "log": lambda v, value: (guarded(do("gt", v[0], TINY), lambda: do("div", 1.0, v[0])),),
            "sin": lambda v, value: (do("cos", v[0]),),
            "cos": lambda v, value: (do("neg", do("sin", v[0])),),
            "tan": lambda v, value: (do("add", 1.0, do("mul", value, value)),),
            "asin": lambda v, value: self._arc_slope(v[0], 1.0),
            "acos": lambda v, value: self._arc_slope(v[0], -1.0),
            "atan": lambda v, value: (do("div", 1.0, do("add", 1.0, do("mul", v[0], v[0]))),),
            "atan2": lambda v, value: self._arctangent_slopes(v[0], v[1]),
            "mod": lambda v, value: (1.0, do("neg", do("floor", do("div", v[0], v[1])))),
            "cpow_re": lambda v, value: self._complex_power_slopes("cpow_re", v),
            "cpow_im": lambda v, value: self._complex_power_slopes("cpow_im", v),
        }

    def call(self, function: str, arguments: list[Any]) -> Any:
        """The function's value: a Dual, or a number of the base where nothing varies."""
        values = [a.value if isinstance(a, Dual) else a for a in arguments]
        varying = [(i, a) for i, a in enumerate(arguments) if isinstance(a, Dual)]
        if function in _TRUTH or function in ("sign", "floor") or not varying:
            return self._base(function, *values)
        if function == "where":
            return self._where(values[0], arguments[1], arguments[2])
        if function in ("min", "max"):
            chosen = self._base("le" if function == "min" else "ge", *values)
            return self._where(chosen, arguments[0], arguments[1])
        if function == "clamp":
            return self.call("min", [self.call("max", [arguments[0], arguments[1]]), arguments[2]])
        value = self._base(function, *values)
        slopes = self._slopes[function](values, value)
        partials = [
            self._sum([self._base("mul", slopes[i], a.partials[j]) for i, a in varying])
            for j in range(len(varying[0][1].partials))
        ]
        return Dual(value, tuple(partials))

    def _base(self, function: str, *arguments: Any) -> Any:
        return call_any(function, list(arguments), self.base)

    def _sum(self, terms: list[Any]) -> Any:
        total = terms[0]
        for term in terms[1:]:
            total = self._base("add", total, term)
        return total

    def _where(self, condition: Any, a: Any, b: Any) -> Any:
        if isinstance(condition, bool):
            return a if condition else b
        count = (
            len((a if isinstance(a, Dual) else b).partials)
            if isinstance(a, Dual) or isinstance(b, Dual)
            else 0
        )
        if not count:
            return self._base("where", condition, a, b)
        left, right = (x if isinstance(x, Dual) else Dual(x, (0.0,) * count) for x in (a, b))
        partials = zip(left.partials, right.partials, strict=True)
        return Dual(
            self._base("where", condition, left.value, right.value),
            tuple(self._base("where", condition, p, q) for p, q in partials),
        )

    def _guarded(self, condition: Any, slope: Callable[[], Any]) -> Any:
        """A slope where the condition holds, else 0."""
        if isinstance(condition, bool):
            return slope() if condition else 0.0
        return self._base("where", condition, slope(), 0.0)

    def _arctangent_slopes(self, y: Any, x: Any) -> tuple[Any, Any]:
        square = self._base("add", self._base("mul", y, y), self._base("mul", x, x))
        outside = self._base("gt", square, 0.0)
        return (
            self._guarded(outside, lambda: self._base("div", x, square)),
            self._guarded(outside, lambda: self._base("neg", self._base("div", y, square))),
        )

    def _arc_slope(self, x: Any, sign: float) -> tuple[Any]:
        square = self._base("mul", self._base("sub", 1.0, x), self._base("add", 1.0, x))
        root = self._base("sqrt", square)
        return (self._guarded(self._base("gt", square, 0.0), lambda: self._base("div", sign, root)),)

    def _finite(self, slope: Any) -> Any:
        return self._guarded(self._base("le", self._base("abs", slope), 1e300), lambda: slope)

    def _complex_power_slopes(self, function: str, v: list[Any]) -> tuple[Any, Any, float]:
        # d (x + iy)^n = n (x + iy)^(n-1) (dx + i dy)
        re = self._base("mul", v[2], self._base("cpow_re", v[0], v[1], v[2] - 1))
        im = self._base("mul", v[2], self._base("cpow_im", v[0], v[1], v[2] - 1))
        return (re, self._base("neg", im), 0.0) if function == "cpow_re" else (im, re, 0.0)


_TRUTH = frozenset(("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not"))


def constant_dual(value: Any, count: int) -> Dual:
    """A value as a Dual with zero partials."""
    return value if isinstance(value, Dual) else Dual(value, (0.0,) * count)


def seeded(values: list[Any]) -> list[Dual]:
    """Independent variables: partial i of variable i is 1."""
    return [Dual(v, tuple(1.0 if i == j else 0.0 for j in range(len(values)))) for i, v in enumerate(values)]
