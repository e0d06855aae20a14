"""The canonical table of operations: what each means, how near an implementation must come, and its slopes.

Every number type of `kernels/numbers/` is tested with this one table: `real` on values, `dual` on values and
partials.

Tolerances of built-in functions are those of the OpenCL 1.2 specification, section 7.4 (ULP values for
single and double precision): division 2.5 (float) or correctly rounded (double), sqrt 3 or correctly rounded,
rsqrt 2, exp and log 3, sin and cos 4, tan 5, asin and acos 4, atan 5, atan2 6, pow 16; abs, floor, min, max
and comparisons are exact; sums and products rounded.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mpmath
import numpy as np

from tests.numbers.exact import (
    INF,
    NAN,
    Exact,
    arc_slope,
    atan2,
    clamp,
    divide,
    exactly,
    finite,
    finite_or_zero,
    log_smallest,
    maximum,
    minimum,
    mod_choices,
    modulo,
    mpf,
    normalized,
    power,
    sign,
    total,
    within_one,
)


@dataclass(frozen=True, slots=True)
class Operation:
    """One operation.

    Attributes:
        name: `add` for `real_add` and `dual_add`.
        arity: how many of the arguments a, b, c it takes.
        value: its value at floats, exact.
        ulps: largest error of the value, in units in the last place, for float32 and float64.
        real: the C text over plain numbers `a`, `b`, `c`; empty if there is none.
        duals: C texts over duals `A`, `B`, `C` and plain numbers.
        slopes: the partial derivatives by a, b and c, as the conventions of `dual.h` have them.
        slope_ulps: largest error of each slope, in units in its last place.
        unit: what errors of the value are measured by, where it is not the value (sums that cancel).
        added: partials that an operation adds by itself (coordinates of the point).
        loose: where drivers are known to be wrong and no formula goes: any number but NaN is accepted.
        choices: other values and slopes that rounding inside the operation may lead to.
    """

    name: str
    arity: int
    value: Callable[..., Exact]
    ulps: tuple[float, float] = (0.0, 0.0)
    real: str = ""
    duals: tuple[str, ...] = ()
    slopes: Callable[..., Sequence[Exact]] | None = None
    slope_ulps: Callable[..., float] = lambda *a: 0.0
    loose: Callable[..., bool] = lambda *a: False
    unit: Callable[..., Exact] | None = None
    added: tuple[float, float, float] = (0.0, 0.0, 0.0)
    choices: Callable[..., Sequence[tuple[Exact, Sequence[Exact]]]] | None = None


def lifted(call: str) -> list[int]:
    """Which of a, b and c a call over duals takes as duals."""
    return [index for index, letter in enumerate("ABC") if re.search(rf"\b{letter}\b", call)]


def table(precision: str) -> list[Operation]:
    """All operations; what overflows depends on the precision."""
    single = precision == "float32"
    smallest = 2.0**-126 if single else 2.0**-1022
    largest = (2 - 2.0**-23) * 2.0**127 if single else (2 - 2.0**-52) * 2.0**1023
    log_least = 2.0**-126
    logarithm = log_smallest(log_least)

    def power_slope(x: float, y: float) -> Exact:
        # y - 1 is a number of the precision before it is an exponent
        exponent = float(np.dtype(precision).type(y) - np.dtype(precision).type(1))
        size = power(x, exponent)
        if not finite(y) or not mpmath.isfinite(size) or abs(size) > largest:
            return mpf(0)
        return finite_or_zero(mpf(y) * size, largest)

    def power_log(value: float, x: float) -> Exact:
        return finite_or_zero(value * logarithm(x) if finite(value) and x != INF else INF, largest)

    def pow_slopes(x: float, y: float) -> Sequence[Exact]:
        value = power(x, y)
        by_y = finite_or_zero(value * logarithm(x), largest) if mpmath.isfinite(value) else mpf(0)
        return power_slope(x, y), by_y

    def log_slopes(a: float) -> Sequence[Exact]:
        return (1 / mpf(a) if a > log_least else mpf(0),)

    def atan2_slopes(y: float, x: float) -> Sequence[Exact]:
        square = mpf(x) ** 2 + mpf(y) ** 2
        return (mpf(x) / square, -mpf(y) / square) if square > 0 else (mpf(0), mpf(0))

    def min_slopes(a: float, b: float) -> Sequence[Exact]:
        return (1, 0) if a <= b or math.isnan(b) else (0, 1)

    def max_slopes(a: float, b: float) -> Sequence[Exact]:
        return (1, 0) if b <= a or math.isnan(b) else (0, 1)

    def clamp_slopes(a: float, low: float, high: float) -> Sequence[Exact]:
        above, inner = max_slopes(a, low), min_slopes(maximum(a, low), high)
        return above[0] * inner[0], above[1] * inner[0], inner[1]

    def bounded(a: float, low: float, high: float) -> float:
        return clamp(a, -1.0 if math.isnan(low) else low, 1.0 if math.isnan(high) else high)

    def product_and(name: str, value: Callable[[Exact, Exact, Exact], Exact]) -> Operation:
        # Whether a device rounds the product by itself is its own affair.
        return Operation(
            name,
            3,
            exactly(value),
            (1.5, 1.5),
            f"real_{name}(a, b, c)",
            loose=lambda a, b, c: finite(a, b, c) and abs(mpf(a) * mpf(b)) > largest,
            unit=lambda a, b, c: abs(mpf(a) * mpf(b)) + abs(mpf(c)),
        )

    def both(name: str, arguments: str) -> tuple[str, str]:
        return f"real_{name}({arguments})", f"dual_{name}({arguments.upper()})"

    def unary(
        name: str,
        value: Callable[[float], Exact],
        ulps: tuple[float, float],
        slope: Callable[[float], Exact],
        slope_ulps: float,
        real: str = "",
    ) -> Operation:
        text, dual = both(name, "a")
        return Operation(
            name, 1, value, ulps, real or text, (dual,), lambda a: (slope(a),), lambda a: slope_ulps
        )

    quotient = (2.5, 0.5)
    divided = 2.5 if single else 0.5
    rooted = 3.0 if single else 0.5
    half = (0.5, 0.5)

    sums = [
        Operation(
            "add",
            2,
            exactly(lambda a, b: a + b),
            half,
            "real_add(a, b)",
            ("dual_add(A, B)", "dual_add_real(A, b)"),
            lambda a, b: (1, 1),
        ),
        Operation(
            "sub",
            2,
            exactly(lambda a, b: a - b),
            half,
            "real_sub(a, b)",
            ("dual_sub(A, B)", "dual_sub_real(A, b)", "real_sub_dual(a, B)"),
            lambda a, b: (1, -1),
        ),
        Operation(
            "mul",
            2,
            exactly(lambda a, b: a * b),
            half,
            "real_mul(a, b)",
            ("dual_mul(A, B)", "dual_mul_real(A, b)"),
            lambda a, b: (b, a),
        ),
        # Another value with the same partials.
        Operation("with", 2, lambda a, b: b, (0, 0), "", ("dual_with(A, b)",), lambda a, b: (1, 0)),
        product_and("fma", lambda a, b, c: a * b + c),
        product_and("fms", lambda a, b, c: a * b - c),
        product_and("fnma", lambda a, b, c: c - a * b),
        Operation(
            "square", 1, exactly(lambda a: a * a), half, "", ("dual_square(A)",), lambda a: (2 * mpf(a),)
        ),
        Operation(
            "div",
            2,
            divide,
            quotient,
            "real_div(a, b)",
            ("dual_div(A, B)", "dual_div_real(A, b)", "real_div_dual(a, B)"),
            lambda a, b: (divide(1.0, b), -divide(a, b) / b if b != 0 else NAN),
            lambda a, b: 2 * divided + 1,
        ),
        Operation("neg", 1, lambda a: -a, (0, 0), *_texts("neg", "a"), lambda a: (-1,)),
        Operation(
            "mod",
            2,
            modulo,
            (1.5, 1.5),
            *_texts("mod", "ab"),
            lambda a, b: (1, -mpmath.floor(divide(a, b)) if mpmath.isfinite(divide(a, b)) else NAN),
            unit=lambda a, b: 2 * abs(mpf(a)) + abs(mpf(b)),
            choices=lambda a, b: mod_choices(a, b, smallest, largest),
        ),
    ]
    kinks = [
        Operation("abs", 1, abs, (0, 0), *_texts("abs", "a"), lambda a: (sign(a),)),
        Operation("sign", 1, lambda a: sign(a), (0, 0), *_texts("sign", "a"), lambda a: (0,)),
        Operation(
            "floor",
            1,
            lambda a: float(math.floor(a)) if finite(a) else a,
            (0, 0),
            *_texts("floor", "a"),
            lambda a: (0,),
        ),
        Operation("min", 2, minimum, (0, 0), *_texts("min", "ab"), min_slopes),
        Operation("max", 2, maximum, (0, 0), *_texts("max", "ab"), max_slopes),
        Operation("clamp", 3, clamp, (0, 0), *_texts("clamp", "abc"), clamp_slopes),
        Operation(
            "bounded", 3, bounded, (0, 0), f"real_bounded(a, {_number_or('b', -1)}, {_number_or('c', 1)})"
        ),
        Operation(
            "where",
            3,
            lambda a, b, c: b if a < 0 else c,
            (0, 0),
            "real_where(less(a, R(0.0)), b, c)",
            ("dual_where(less(a, R(0.0)), B, C)",),
            lambda a, b, c: (0, float(a < 0), float(not a < 0)),
        ),
    ]
    functions = [
        unary(
            "sqrt",
            lambda a: INF if a == INF else mpmath.sqrt(maximum(a, 0.0)),
            (3.0, 0.5),
            lambda a: 1 / (2 * mpmath.sqrt(a)) if a > 0 else mpf(0),
            rooted + divided,
        ),
        Operation(
            "rsqrt",
            1,
            lambda a: 0.0 if a == INF else INF if a <= 0 or math.isnan(a) else 1 / mpmath.sqrt(a),
            (2.5, 2.5),
            *_texts("rsqrt", "a"),
            lambda a: (-(mpf(a) ** -1.5) / 2 if a > 0 else INF,),
            lambda a: 10,
            # fmax(-0, 0) is either zero
            choices=lambda a: [(-INF, (INF,))] if a == 0 else [],
        ),
        unary("exp", total(mpmath.exp, INF, 0.0), (3.0, 3.0), mpmath.exp, 3),
        Operation("log", 1, logarithm, (3.0, 3.0), *_texts("log", "a"), log_slopes, lambda a: divided),
        unary("sin", total(mpmath.sin, NAN, NAN), (4.0, 4.0), lambda a: mpmath.cos(mpf(a)), 4),
        unary("cos", total(mpmath.cos, NAN, NAN), (4.0, 4.0), lambda a: -mpmath.sin(mpf(a)), 4),
        unary("tan", total(mpmath.tan, NAN, NAN), (5.0, 5.0), lambda a: 1 + mpmath.tan(mpf(a)) ** 2, 12),
        unary("asin", lambda a: mpmath.asin(mpf(within_one(a))), (4.0, 4.0), arc_slope, 2 + rooted + divided),
        unary(
            "acos",
            lambda a: mpmath.acos(mpf(within_one(a))),
            (4.0, 4.0),
            lambda a: -arc_slope(a),
            2 + rooted + divided,
        ),
        unary(
            "atan",
            total(mpmath.atan, mpmath.pi / 2, -mpmath.pi / 2),
            (5.0, 5.0),
            lambda a: 1 / (1 + mpf(a) ** 2),
            1.5 + divided,
        ),
        Operation(
            "atan2",
            2,
            atan2,
            (6.0, 6.0),
            *_texts("atan2", "ab"),
            atan2_slopes,
            lambda a, b: 2.5 + divided,
            loose=lambda y, x: max(abs(x), abs(y)) > largest / 8,
        ),
        Operation(
            "pow",
            2,
            power,
            (16.0, 16.0),
            "real_pow(a, b)",
            ("dual_pow(A, B)", "dual_pow_real(A, b)"),
            pow_slopes,
            lambda x, y: 17 + 3,
        ),
    ]
    helpers = [
        Operation("finite_or_zero", 1, lambda a: finite_or_zero(a, largest), real="real_finite_or_zero(a)"),
        Operation("arc_slope", 1, arc_slope, (2 * (2 + rooted + divided),) * 2, "real_arc_slope(a)"),
        Operation("power_log", 2, power_log, (8.0, 8.0), "real_power_log(a, b)"),
        Operation("constant", 1, lambda a: a, duals=("dual_constant(a)",), slopes=lambda a: ()),
        Operation(
            "chain", 3, lambda a, b, c: a, duals=("dual_chain(a, b, C)",), slopes=lambda a, b, c: (0, 0, b)
        ),
        Operation(
            "chain2",
            3,
            lambda a, b, c: a,
            duals=("dual_chain2(a, b, B, c, C)",),
            slopes=lambda a, b, c: (0, b, c),
        ),
        Operation(
            "more",
            3,
            lambda a, b, c: a,
            duals=("dual_more(dual_more(dual_chain(a, c, C), b, B), a, A)",),
            slopes=lambda a, b, c: (a, b, c),
        ),
        *(
            Operation(
                f"chain_{axis}",
                3,
                lambda a, b, c: a,
                duals=(f"dual_chain_{axis}(a, b, C)",),
                slopes=lambda a, b, c: (0, 0, b),
                added=_axis(axis),
            )
            for axis in "xyz"
        ),
        *(
            Operation(
                f"coordinate_{axis}",
                1,
                lambda a: a,
                duals=(f"dual_coordinate_{axis}(a)",),
                slopes=lambda a: (),
                added=_axis(axis),
            )
            for axis in "xyz"
        ),
        *(
            Operation(
                f"add_coordinate_{axis}",
                2,
                exactly(lambda a, b: a + b),
                half,
                duals=(f"dual_add_coordinate_{axis}(A, b)",),
                slopes=lambda a, b: (1, 0),
                added=_axis(axis),
            )
            for axis in "xyz"
        ),
        Operation(
            "normalize",
            3,
            normalized,
            (8.0, 8.0),
            "vec_normalize(vec_of(a, b, c)).x",
            loose=lambda *v: finite(*v) and not smallest * 8 < max(map(abs, v)) < largest / 8,
        ),
        Operation("less", 2, lambda a, b: float(a < b), real="pick(less(a, b), R(1.0), R(0.0))"),
        Operation("less_equal", 2, lambda a, b: float(a <= b), real="pick(less_equal(a, b), R(1.0), R(0.0))"),
        Operation("equal", 2, lambda a, b: float(a == b), real="pick(equal(a, b), R(1.0), R(0.0))"),
        Operation("is_nan", 1, lambda a: float(math.isnan(a)), real="pick(is_nan(a), R(1.0), R(0.0))"),
        Operation("not", 2, lambda a, b: float(not a < b), real="pick((~less(a, b)), R(1.0), R(0.0))"),
        Operation(
            "power_slope",
            2,
            power_slope,
            (17.0, 17.0),
            "real_power_slope(a, b)",
        ),
    ]
    return [*sums, *kinks, *functions, *helpers]


def _texts(name: str, arguments: str) -> tuple[str, tuple[str, ...]]:
    """The calls of an operation that has the same form over both number types."""
    return f"real_{name}({', '.join(arguments)})", (f"dual_{name}({', '.join(arguments.upper())})",)


def _number_or(name: str, other: float) -> str:
    """The text of an argument, of whose NaN it makes another number."""
    return f"pick(is_nan({name}), R({float(other)}), {name})"


def _axis(name: str) -> tuple[float, float, float]:
    x, y, z = (float(name == axis) for axis in "xyz")
    return x, y, z
