"""The functions and constants that formulas' texts use, by operations of our formula language."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from clfractal.exchange.arithmetic import Arithmetic
from clfractal.exchange.symbols import Value

NUMBERS: Mapping[str, float] = {
    "M_PI": math.pi,
    "M_PI_F": math.pi,
    "M_PI_2": math.pi / 2,
    "M_PI_2F": math.pi / 2,
    "M_PI_2_F": math.pi / 2,
    "M_PI_2x": 2 * math.pi,
    "M_PI_4": math.pi / 4,
    "M_PI_8": math.pi / 8,
    "M_PI_180": math.pi / 180,
    "SQRT_1_3": math.sqrt(1 / 3),
    "SQRT_1_2": math.sqrt(1 / 2),
    "SQRT_2_3": math.sqrt(2 / 3),
    "SQRT_3_2": math.sqrt(3 / 2),
    "SQRT_3_4": math.sqrt(3 / 4),
    "SQRT_3_4d2": math.sqrt(3 / 4) / 2,
    "SQRT_3": math.sqrt(3),
    "FRAC_1_3": 1 / 3,
    "IFS_VECTOR_COUNT": 9.0,
    "true": 1.0,
    "false": 0.0,
}
"""What has a name in the texts."""

_SAME = (
    "abs",
    "sqrt",
    "exp",
    "log",
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan",
    "atan2",
    "floor",
    "min",
    "max",
    "sign",
)
_NAMES = {"fabs": "abs", "pow": "**", "powr": "**", "divide": "/", "fmin": "min", "fmax": "max"}


def call_function(run: Arithmetic, name: str, values: Sequence[object]) -> object:
    """The value of a function.

    Raises:
        FileError: it has no counterpart.
    """
    plain = name.removeprefix("native_").removeprefix("half_").removeprefix("fast_")
    plain = _NAMES.get(plain, plain)
    if plain in (*_SAME, "**", "/"):
        return run.each(lambda *parts: run.call(plain, *parts), *values)
    of_numbers = _OF_NUMBERS.get(plain)
    if of_numbers is not None:
        return run.each(lambda *parts: of_numbers(run, *parts), *values)
    of_vectors = _OF_VECTORS.get(name) or _OF_VECTORS.get(plain)
    if of_vectors is None:
        run.refuse(f"the function {name}")
    if any(run.is_nothing(value) for value in values):
        return run.nothing
    try:
        return of_vectors(run, *values)
    except TypeError:
        return run.refuse(f"{name} of so many values")


def _mad(run: Arithmetic, a: Value, b: Value, c: Value) -> Value:
    return run.call("+", run.call("*", a, b), c)


def _recip(run: Arithmetic, a: Value) -> Value:
    return run.call("/", 1.0, a)


def _rsqrt(run: Arithmetic, a: Value) -> Value:
    return run.call("/", 1.0, run.call("sqrt", a))


def _fmod(run: Arithmetic, a: Value, b: Value) -> Value:
    # The quotient is cut towards 0.
    quotient = run.call("/", a, b)
    whole = run.call("*", run.call("sign", quotient), run.call("floor", run.call("abs", quotient)))
    return run.call("-", a, run.call("*", b, whole))


def _round(run: Arithmetic, a: Value) -> Value:
    away = run.call("floor", run.call("+", run.call("abs", a), 0.5))
    return run.call("*", run.call("sign", a), away)


def _ceil(run: Arithmetic, a: Value) -> Value:
    return run.symbols.negative(run.call("floor", run.symbols.negative(a)))


def _clamp(run: Arithmetic, a: Value, low: Value, high: Value) -> Value:
    return run.call("min", run.call("max", a, low), high)


def _exp2(run: Arithmetic, a: Value) -> Value:
    return run.call("exp", run.call("*", math.log(2), a))


def _mix(run: Arithmetic, a: Value, b: Value, part: Value) -> Value:
    return run.call("+", a, run.call("*", part, run.call("-", b, a)))


def _whole(run: Arithmetic, a: Value) -> Value:
    if isinstance(a, float):
        return float(math.trunc(a))
    return run.call("*", run.call("sign", a), run.call("floor", run.call("abs", a)))


def _smooth(sign: float) -> Callable[..., Value]:
    def condition(run: Arithmetic, a: Value, b: Value, sharpness: Value) -> Value:
        grown = run.call("exp", run.call("*", sharpness, run.call("*", sign, run.call("-", a, b))))
        return run.call("/", 1.0, run.call("+", 1.0, grown))

    return condition


_OF_NUMBERS: Mapping[str, Callable[..., Value]] = {
    "mad": _mad,
    "fma": _mad,
    "recip": _recip,
    "rsqrt": _rsqrt,
    "fmod": _fmod,
    "round": _round,
    "ceil": _ceil,
    "trunc": _whole,
    "clamp": _clamp,
    "exp2": _exp2,
    "mix": _mix,
    "(int)": _whole,
    "(float)": lambda run, a: a,
    "(REAL)": lambda run, a: a,
    "(double)": lambda run, a: a,
    "(bool)": lambda run, a: run.plain(run.symbols.condition(a)),
    "SmoothConditionAGreaterB": _smooth(-1.0),
    "SmoothConditionALessB": _smooth(1.0),
}


def _length(run: Arithmetic, a: object) -> object:
    return run.length(a)


def _dot(run: Arithmetic, a: object, b: object) -> object:
    return run.dot(a, b)


def _normalize(run: Arithmetic, a: object) -> object:
    length = run.length(a)
    return run.each(lambda part: run.call("/", part, length), a)


def _distance(run: Arithmetic, a: object, b: object) -> object:
    return run.length(run.operator("-", a, b))


def _cross(run: Arithmetic, a: object, b: object) -> object:
    p, q = run.vector_of(a), run.vector_of(b)

    def part(i: int, j: int) -> Value:
        return run.call("-", run.call("*", p[i], q[j]), run.call("*", p[j], q[i]))

    return [part(1, 2), part(2, 0), part(0, 1), *([0.0] if len(p) == 4 else [])]


def _turned(run: Arithmetic, matrix: object, vector: object) -> object:
    rows, found = run.rows_of(matrix), run.vector_of(vector)
    return [*(run.dot(row, found[:3]) for row in rows), *found[3:]]


def _around(run: Arithmetic, vector: object, axis: object, angle: object) -> object:
    """Rodrigues' formula."""
    v, k, by = run.vector_of(vector), run.vector_of(axis), run.scalar_of(angle)
    cosine, sine = run.call("cos", by), run.call("sin", by)
    turned = run.operator(
        "+", run.operator("*", v[:3], cosine), run.operator("*", _cross(run, k, v[:3]), sine)
    )
    along = run.call("*", run.dot(k, v[:3]), run.call("-", 1.0, cosine))
    found = run.vector_of(run.operator("+", turned, run.operator("*", k, along)))
    return [*found, *v[3:]]


def _wrap(run: Arithmetic, x: object, period: object, shift: object) -> object:
    moved = run.operator("-", x, shift)
    wholes = run.each(lambda a, b: run.call("floor", run.call("/", a, b)), moved, period)
    return run.operator("+", run.operator("-", moved, run.operator("*", period, wholes)), shift)


def _turning(axis: int) -> Callable[..., object]:
    def turn(run: Arithmetic, matrix: object, angle: object) -> object:
        by = run.scalar_of(angle)
        c, s = run.call("cos", by), run.call("sin", by)
        i, j = ((1, 2), (2, 0), (0, 1))[axis]
        rows = []
        for row in run.rows_of(matrix):
            found = list(row)
            found[i] = run.call("+", run.call("*", row[i], c), run.call("*", row[j], s))
            found[j] = run.call("-", run.call("*", row[j], c), run.call("*", row[i], s))
            rows.append(found)
        return rows

    return turn


_OF_VECTORS: Mapping[str, Callable[..., object]] = {
    "length": _length,
    "dot": _dot,
    "normalize": _normalize,
    "distance": _distance,
    "cross": _cross,
    "Matrix33MulFloat4": _turned,
    "Matrix33MulFloat3": _turned,
    "RotateAroundVectorByAngle": _around,
    "RotateAroundVectorByAngle4": _around,
    "RotateX": _turning(0),
    "RotateY": _turning(1),
    "RotateZ": _turning(2),
    "wrap": _wrap,
}
