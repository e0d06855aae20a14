"""Evaluates a tree with any kind of number; what is constant is always evaluated here, with Python's doubles.

The conventions below hold for every reader of the tree (the OpenCL writer follows them), so that a point is
never NaN because of an argument outside a function's domain:

- sqrt of a negative number is 0; asin and acos clamp their argument to [-1, 1]; log(x) is log(max(x, TINY)).
- atan2(0, 0) = 0, sign(0) = 0, mod(x, y) = x - y*floor(x/y); min and max take the first of equal arguments.
- x**n with a constant whole n multiplies (a negative n: the reciprocal). Otherwise it is exp(n*log(x)) for x
> 0; for
  x < 0 the signed power where n happens to be whole, else 0; at x = 0: 0 for n > 0, 1 for n = 0, infinity for
  n < 0.
- cpow_re and cpow_im are 0 at x = y = 0 for n other than 0, and (1, 0) for n = 0.
- x/0 is IEEE's: an infinity, or NaN for 0/0.
- `where` never lets the branch that is not taken into the result.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from operator import itemgetter
from typing import Any, Protocol

from clfractal.errors import FormulaError, Where
from clfractal.formulas.nodes import Name, Node, Number

# The smallest normal float32: what log sees in place of 0 and below, in every precision.
TINY = 2.0**-126
# Whole exponents beyond this are refused: nothing useful is left of a float32 there, and every one costs
# code.
MAX_EXPONENT = 1000


class Backend(Protocol):
    """A kind of number: how to call each function on it. Constants reach it as Python floats."""

    def call(self, function: str, arguments: list[Any]) -> Any:
        """The function's value; for comparisons and logic a Python bool or the backend's truth values."""


def evaluate(node: Node, names: Mapping[str, Any], backend: Backend | None = None) -> Any:
    """The tree's value, with `names` giving each name's value in the backend's numbers or as a Python float.

    A part that depends on no backend number is a Python float, so exponents stay recognisably constant.

    Raises:
        FormulaError: a name without a value.
    """
    if isinstance(node, Number):
        return node.value
    if isinstance(node, Name):
        try:
            return names[node.name]
        except KeyError:
            raise FormulaError(f"{node.name!r} has no value here") from None
    if node.function == "where":
        condition = evaluate(node.arguments[0], names, backend)
        if isinstance(condition, bool):
            return evaluate(node.arguments[1 if condition else 2], names, backend)
        branches = [evaluate(argument, names, backend) for argument in node.arguments[1:]]
        return call_any("where", [condition, *branches], backend)
    return call_any(
        node.function, [evaluate(argument, names, backend) for argument in node.arguments], backend
    )


def call_any(function: str, arguments: list[Any], backend: Backend | None) -> Any:
    """One function on numbers of the backend, or on Python floats alone."""
    # type() and not isinstance(): numpy.float64 is a subclass of float but is not a constant of the formula.
    if all(type(argument) in (float, int, bool) for argument in arguments):
        return call_float(function, arguments)
    if backend is None:
        raise TypeError(f"{function}: no backend for {arguments!r}")
    return backend.call(function, arguments)


def evaluate_constant(node: Node, values: Mapping[str, float]) -> float:
    """The value of a tree that depends on parameters alone.

    Raises:
        FormulaError: a name without a value, or a result that is not a finite number.
    """
    return finite(evaluate(node, {name: float(value) for name, value in values.items()}))


def finite(value: Any) -> float:
    """The value as a float; FormulaError unless it is a finite number."""
    number = float(value)
    if not math.isfinite(number):
        raise FormulaError("is not a finite number", Where())
    return number


def as_function(node: Node) -> Callable[[Mapping[str, float]], Any]:
    """The tree as a Python function of the values of its names, which must be floats.

    It gives exactly what `evaluate` gives, some ten times faster; making it costs as much as a few evaluations.
    A name without a value raises KeyError.
    """
    if isinstance(node, Number):
        number = node.value
        return lambda values: number
    if isinstance(node, Name):
        return itemgetter(node.name)
    function = _FLOAT_FUNCTIONS[node.function]
    parts = [as_function(argument) for argument in node.arguments]
    if len(parts) == 1:
        (only,) = parts
        return lambda values: function(only(values))
    if len(parts) == 2:
        first, second = parts
        return lambda values: function(first(values), second(values))
    first, second, third = parts
    if node.function == "where":
        return lambda values: second(values) if first(values) else third(values)
    return lambda values: function(first(values), second(values), third(values))


def whole(value: Any) -> int | None:
    """The integer that a constant equals, or None (also for anything that is no constant)."""
    if type(value) not in (float, int) or not math.isfinite(value) or value != math.floor(value):
        return None
    return int(value)


def power_by_squaring(base: Any, exponent: int, multiply: Callable[[Any, Any], Any], one: Any) -> Any:
    """base**exponent for exponent >= 0 by repeated multiplication."""
    result, square = None, base
    while exponent:
        if exponent & 1:
            result = square if result is None else multiply(result, square)
        exponent >>= 1
        if exponent:
            square = multiply(square, square)
    return one if result is None else result


def complex_multiply(a: tuple[Any, Any], b: tuple[Any, Any]) -> tuple[Any, Any]:
    """The product of two complex numbers given as (real, imaginary)."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _divide(a: float, b: float) -> float:
    if b != 0:
        return a / b
    if a == 0 or math.isnan(a):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def _pow(x: float, n: float) -> float:
    exponent = whole(n)
    if exponent is not None and abs(exponent) <= MAX_EXPONENT:
        power: float = power_by_squaring(x, abs(exponent), lambda a, b: a * b, 1.0)
        return power if exponent >= 0 else _divide(1.0, power)
    if math.isnan(x) or math.isnan(n):
        return math.nan
    if x > 0:
        return _exp(n * math.log(x))
    if x < 0:
        return 0.0 if exponent is None else _exp(n * math.log(-x)) * (-1.0 if exponent % 2 else 1.0)
    return 0.0 if n > 0 else math.inf


def _cpow(x: float, y: float, n: float) -> tuple[float, float]:
    if n == 0:
        return 1.0, 0.0
    if x == 0 and y == 0:
        return 0.0, 0.0
    exponent = whole(n)
    if exponent is not None and abs(exponent) <= MAX_EXPONENT:
        re, im = power_by_squaring((x, y), abs(exponent), complex_multiply, (1.0, 0.0))
        size = re * re + im * im
        return (re, im) if exponent > 0 else (_divide(re, size), _divide(-im, size))
    radius, angle = _pow(math.hypot(x, y), n), n * math.atan2(y, x)
    return radius * _trig(math.cos, angle), radius * _trig(math.sin, angle)


def _exp(x: float) -> float:
    try:
        return math.exp(x)
    except OverflowError:
        return math.inf


def _trig(function: Callable[[float], float], x: float) -> float:
    return function(x) if math.isfinite(x) else math.nan


def _floor(x: float) -> float:
    return float(math.floor(x)) if math.isfinite(x) else x


_FLOAT_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": _divide,
    "pow": _pow,
    "neg": lambda a: -a,
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
    "and": lambda a, b: a and b,
    "or": lambda a, b: a or b,
    "not": lambda a: not a,
    "abs": abs,
    "sign": lambda a: float((a > 0) - (a < 0)),
    "sqrt": lambda a: math.sqrt(a) if a > 0 else 0.0,
    "exp": _exp,
    "log": lambda a: math.log(max(a, TINY)),
    "log2": lambda a: math.log2(max(a, TINY)),
    "sin": lambda a: _trig(math.sin, a),
    "cos": lambda a: _trig(math.cos, a),
    "tan": lambda a: _trig(math.tan, a),
    "asin": lambda a: math.asin(min(max(a, -1.0), 1.0)),
    "acos": lambda a: math.acos(min(max(a, -1.0), 1.0)),
    "atan": math.atan,
    "atan2": lambda y, x: 0.0 if x == 0 and y == 0 else math.atan2(y, x),
    "min": lambda a, b: a if a <= b else b,
    "max": lambda a, b: a if a >= b else b,
    "clamp": lambda a, low, high: min(max(a, low), high),
    "floor": _floor,
    "mod": lambda x, y: x - y * _floor(_divide(x, y)),
    "where": lambda condition, a, b: a if condition else b,
    "cpow_re": lambda x, y, n: _cpow(x, y, n)[0],
    "cpow_im": lambda x, y, n: _cpow(x, y, n)[1],
}


def call_float(function: str, arguments: list[Any]) -> Any:
    """One function on Python floats; never raises for a finite or infinite argument."""
    return _FLOAT_FUNCTIONS[function](*arguments)
