"""The functions of GLSL, and those that fragments include, by operations of our language."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from clfractal.exchange.functions import call_function
from clfractal.exchange.glsl_arithmetic import GlslArithmetic
from clfractal.exchange.glsl_symbols import Matrix
from clfractal.exchange.symbols import Value

HELPERS = frozenset(("mathutils", "complex", "complexbase", "quaternion", "quaternionmath"))
"""Files of functions, which are not read: those below are told in our own words."""

_SAME = {
    **{name: name for name in ("abs", "sqrt", "exp", "log", "sin", "cos", "tan", "asin", "acos", "floor")},
    **{
        name: name for name in ("min", "max", "sign", "clamp", "mix", "round", "trunc", "ceil", "exp2", "fma")
    },
    "roundEven": "round",
    "inversesqrt": "rsqrt",
}
"""Functions of numbers that formulas' texts in C have, too, and their names there."""


def call_glsl(run: GlslArithmetic, name: str, values: Sequence[object]) -> object:
    """The value of a function.

    Raises:
        FileError: it has no counterpart, or not of such values.
    """
    of_all = _OF_ALL.get(name)
    try:
        if of_all is not None:
            return of_all(run, *values)
        run.check_sizes(values)
        of_numbers = _OF_NUMBERS.get(name)
        if of_numbers is not None:
            return run.each(lambda *parts: of_numbers(run, *parts), *values)
        if name in _SAME:
            if name == "mix" and len(values) == 3 and run.is_choice(values[2]):
                return run.each(lambda a, b, c: run.symbols.choose(c, b, a), *values)
            return call_function(run, _SAME[name], values)
    except TypeError:
        return run.refuse(f"{name} of {len(values)} values")
    return run.refuse(f"the function {name[:60]}")


def is_known(name: str) -> bool:
    """Whether there is a function of this name."""
    return name in _OF_ALL or name in _OF_NUMBERS or name in _SAME


# --- of numbers


def _mod(run: GlslArithmetic, a: Value, b: Value) -> Value:
    return run.call("-", a, run.call("*", b, run.call("floor", run.call("/", a, b))))


def _smoothstep(run: GlslArithmetic, low: Value, high: Value, a: Value) -> Value:
    part = run.call("/", run.call("-", a, low), run.call("-", high, low))
    t = run.call("min", run.call("max", part, 0.0), 1.0)
    return run.call("*", run.call("*", t, t), run.call("-", 3.0, run.call("*", 2.0, t)))


def _atan(run: GlslArithmetic, a: Value, b: Value | None = None) -> Value:
    return run.call("atan", a) if b is None else run.call("atan2", a, b)


def _half_exp(sign: str) -> Callable[..., Value]:
    def function(run: GlslArithmetic, a: Value) -> Value:
        grown, shrunk = run.call("exp", a), run.call("exp", run.symbols.negative(a))
        return run.call("*", 0.5, run.call(sign, grown, shrunk))

    return function


def _tanh(run: GlslArithmetic, a: Value) -> Value:
    shrunk = run.call("exp", run.call("*", -2.0, run.call("abs", a)))
    size = run.call("/", run.call("-", 1.0, shrunk), run.call("+", 1.0, shrunk))
    return run.call("*", run.call("sign", a), size)


def _compared(sign: str) -> Callable[..., Value]:
    return lambda run, a, b: run.call(sign, a, b)


_OF_NUMBERS: Mapping[str, Callable[..., Value]] = {
    "pow": lambda run, a, b: run.call("**", a, b),
    "mod": _mod,
    "fract": lambda run, a: run.call("-", a, run.call("floor", a)),
    "step": lambda run, edge, a: run.symbols.choose(run.call("<", a, edge), 0.0, 1.0),
    "smoothstep": _smoothstep,
    "atan": _atan,
    "log2": lambda run, a: run.call("*", 1 / math.log(2), run.call("log", a)),
    "radians": lambda run, a: run.call("*", math.pi / 180, a),
    "degrees": lambda run, a: run.call("*", 180 / math.pi, a),
    "sinh": _half_exp("-"),
    "cosh": _half_exp("+"),
    "tanh": _tanh,
    "lessThan": _compared("<"),
    "lessThanEqual": _compared("<="),
    "greaterThan": _compared(">"),
    "greaterThanEqual": _compared(">="),
    "equal": _compared("=="),
    "notEqual": _compared("!="),
    "not": lambda run, a: run.symbols.opposite(run.symbols.condition(a)),
}


# --- of vectors


def _length(run: GlslArithmetic, a: object) -> object:
    return run.length(a)


def _dot(run: GlslArithmetic, a: object, b: object) -> object:
    run.check_sizes((a, b))
    return run.dot(a, b) if isinstance(a, list) else run.operator("*", a, b)


def _normalize(run: GlslArithmetic, a: object) -> object:
    length = run.length(a)
    return run.each(lambda part: run.call("/", part, length), a)


def _distance(run: GlslArithmetic, a: object, b: object) -> object:
    return run.length(run.operator("-", a, b))


def _cross(run: GlslArithmetic, a: object, b: object) -> object:
    if not (isinstance(a, list) and isinstance(b, list) and len(a) == len(b) == 3):
        run.refuse("cross of what is no vec3")
    return call_function(run, "cross", (a, b))


def _reflect(run: GlslArithmetic, a: object, n: object) -> object:
    return run.operator("-", a, run.operator("*", run.call("*", 2.0, run.dot(n, a)), n))


def _any(run: GlslArithmetic, a: object) -> object:
    found: Value = 0.0
    for part in run.vector_of(a):
        found = run.symbols.either(found, run.symbols.condition(part))
    return found


def _all(run: GlslArithmetic, a: object) -> object:
    found: Value = 1.0
    for part in run.vector_of(a):
        found = run.symbols.both(found, run.symbols.condition(part))
    return found


def _transpose(run: GlslArithmetic, a: object) -> object:
    matrix = run.matrix_of(a)
    return Matrix(tuple(tuple(matrix.row(place)) for place in range(len(matrix.columns))))


# --- of files that fragments include


def _around(run: GlslArithmetic, axis: object, angle: object) -> Matrix:
    """The matrix by which a row vector turns about an axis of length 1, by an angle in degrees."""
    x, y, z = run.vector_of(axis)[:3]
    by = run.call("*", math.pi / 180, run.scalar_of(angle))
    c, s = run.call("cos", by), run.call("sin", by)
    rest = run.call("-", 1.0, c)

    def part(a: Value, b: Value, other: Value) -> Value:
        return run.call("+", run.call("*", rest, run.call("*", a, b)), other)

    def turned(sign: float, a: Value) -> Value:
        return run.call("*", run.call("*", sign, s), a)

    return Matrix(
        (
            (part(x, x, c), part(x, y, turned(-1.0, z)), part(x, z, turned(1.0, y))),
            (part(x, y, turned(1.0, z)), part(y, y, c), part(y, z, turned(-1.0, x))),
            (part(x, z, turned(-1.0, y)), part(y, z, turned(1.0, x)), part(z, z, c)),
        )
    )


def _rotation3(run: GlslArithmetic, axis: object, angle: object) -> object:
    if len(run.vector_of(axis)) != 3:
        run.refuse("an axis that is no vec3")
    return _around(run, axis, angle)


def _rotation4(run: GlslArithmetic, axis: object, angle: object) -> object:
    return run.grown(_around(run, axis, angle), 4)


def _rotation_xyz(run: GlslArithmetic, angles: object) -> object:
    by = run.vector_of(angles)
    axes: list[list[Value]] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    found: object = _around(run, axes[0], by[0])
    for axis, angle in zip(axes[1:], by[1:], strict=False):
        found = run.product(found, _around(run, axis, angle))
    return found


def _translate(run: GlslArithmetic, by: object) -> object:
    moved = run.vector_of(by)[:3]
    return Matrix(((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (*moved, 1.0)))


def _scale4(run: GlslArithmetic, by: object) -> object:
    s = run.scalar_of(by)
    return Matrix(((s, 0.0, 0.0, 0.0), (0.0, s, 0.0, 0.0), (0.0, 0.0, s, 0.0), (0.0, 0.0, 0.0, 1.0)))


def _complex(a: object, run: GlslArithmetic) -> tuple[Value, Value]:
    x, y = run.vector_of(a)[:2]
    return x, y


def _c_mul(run: GlslArithmetic, a: object, b: object) -> object:
    (x, y), (u, v) = _complex(a, run), _complex(b, run)
    real = run.call("-", run.call("*", x, u), run.call("*", y, v))
    return [real, run.call("+", run.call("*", x, v), run.call("*", y, u))]


def _c_conj(run: GlslArithmetic, a: object) -> object:
    x, y = _complex(a, run)
    return [x, run.symbols.negative(y)]


def _c_inverse(run: GlslArithmetic, a: object) -> object:
    square = run.dot(a, a)
    return run.each(lambda part: run.call("/", part, square), _c_conj(run, a))


def _c_polar(run: GlslArithmetic, size: Value, angle: Value) -> list[Value]:
    return [run.call("*", size, run.call("cos", angle)), run.call("*", size, run.call("sin", angle))]


def _c_power(run: GlslArithmetic, a: object, n: object) -> object:
    x, y = _complex(a, run)
    exponent = run.scalar_of(n)
    size = run.call("**", run.length([x, y]), exponent)
    return _c_polar(run, size, run.call("*", exponent, run.call("atan2", y, x)))


def _c_exp(run: GlslArithmetic, a: object) -> object:
    x, y = _complex(a, run)
    return _c_polar(run, run.call("exp", x), y)


def _c_log(run: GlslArithmetic, a: object) -> object:
    x, y = _complex(a, run)
    return [run.call("log", run.length([x, y])), run.call("atan2", y, x)]


_OF_ALL: Mapping[str, Callable[..., object]] = {
    "length": _length,
    "dot": _dot,
    "normalize": _normalize,
    "distance": _distance,
    "cross": _cross,
    "reflect": _reflect,
    "any": _any,
    "all": _all,
    "transpose": _transpose,
    "rotationMatrix3": _rotation3,
    "rotationMatrix": _rotation4,
    "rotationMatrixXYZ": _rotation_xyz,
    "translate": _translate,
    "scale4": _scale4,
    "cMul": _c_mul,
    "cConj": _c_conj,
    "cInverse": _c_inverse,
    "cDiv": lambda run, a, b: _c_mul(run, a, _c_inverse(run, b)),
    "cSqr": lambda run, a: _c_mul(run, a, a),
    "cPower": _c_power,
    "cPow": _c_power,
    "cExp": _c_exp,
    "cLog": _c_log,
}
