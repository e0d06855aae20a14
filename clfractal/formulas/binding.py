"""Binds a formula to parameter values, and refuses values for which it is undefined."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, TypeAlias

from clfractal.errors import FormulaError, Where, unknown_name
from clfractal.formulas.definition import MAX_REPEAT, BoundFormula, Formula, inside
from clfractal.formulas.evaluate import MAX_EXPONENT, as_function, finite
from clfractal.formulas.nodes import Call, Node, names_in, walk

MAX_RADIUS = 1e6
MAX_BAILOUT = 1e12


def bind(
    formula: Formula,
    parameters: Mapping[str, Any] | None = None,
    julia: Sequence[float] | None = None,
    bailout: float | None = None,
    where: Where | None = None,
    *,
    distance_bailout: float | None = None,
    live: Sequence[str] = (),
) -> BoundFormula:
    """The formula with values for its parameters; values that are not given are the defaults.

    `julia` (one number for each variable) adds this constant in place of the point. `live` names parameters,
    and has no effect.

    Raises:
        FormulaError: an unknown parameter, a value out of range, a julia of the wrong length, or values that
            give the formula no meaning (no whole repeat, a degree below 1, a division by zero). Its place is
            `where`'s path with `.parameters.NAME`, `.live.INDEX`, `.julia`, `.bailout`.
    """
    where = where or Where()
    known = [parameter.name for parameter in formula.parameters]
    values = {parameter.name: parameter.default for parameter in formula.parameters}
    for name, value in (parameters or {}).items():
        parameter = formula.parameter(name)
        if parameter is None:
            raise FormulaError(
                unknown_name("parameter", str(name), known), inside(where, "parameters", str(name))
            )
        values[name] = parameter.check(value, inside(where, "parameters", name))
    _check_live(live, known, inside(where, "live"))
    bound = BoundFormula(
        formula,
        values,
        _check_julia(formula, julia, inside(where, "julia")),
        check_radius(bailout, inside(where, "bailout")),
        check_radius(distance_bailout, inside(where, "distance_bailout")),
    )
    _check_derived(bound, where)
    _check_constants(bound, where)
    return bound


def check_radius(value: object, where: Where) -> float | None:
    """A radius given by the user as a positive finite float (None stays None); FormulaError otherwise."""
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 < value <= MAX_BAILOUT:
        raise FormulaError(
            f"must be a number above 0 and at most {MAX_BAILOUT:g}, got {str(value)[:60]}", where
        )
    return float(value)


def _check_live(live: object, known: Sequence[str], where: Where) -> None:
    if not isinstance(live, (list, tuple)):
        raise FormulaError("must be a list of names of parameters", where)
    for index, name in enumerate(live):
        if name not in known:
            raise FormulaError(unknown_name("parameter", str(name), known), inside(where, str(index)))


def _check_julia(formula: Formula, julia: object, where: Where) -> tuple[float, ...] | None:
    if julia is None:
        if formula.add == "constant" and formula.julia is None:
            raise FormulaError(
                f"{formula.name} needs a julia constant of {len(formula.variables)} numbers", where
            )
        return formula.julia if formula.add == "constant" else None
    if formula.add == "none":
        raise FormulaError(f"{formula.name} adds nothing, so it has no Julia sets", where)
    return check_constant(julia, len(formula.variables), where)


def check_constant(julia: object, size: int, where: Where) -> tuple[float, ...]:
    """The numbers of a Julia constant; FormulaError unless there are `size` finite ones."""
    if not isinstance(julia, (list, tuple)):
        raise FormulaError(f"must be a list of {size} numbers", where)
    if len(julia) != size:
        raise FormulaError(f"must have {size} numbers, one for each variable, got {len(julia)}", where)
    for index, value in enumerate(julia):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= 1e6:
            raise FormulaError(
                f"must be a number within +-1e6, got {str(value)[:60]}", inside(where, str(index))
            )
    return tuple(float(value) for value in julia)


# What each derived number must satisfy, with the words for it.
_DERIVED: tuple[tuple[str, Callable[[float], bool], str], ...] = (
    ("repeat", lambda v: 0.5 <= v <= MAX_REPEAT + 0.5, f"must be 1 to {MAX_REPEAT}"),
    ("degree", lambda v: 1 <= v <= 1000, "must be 1 to 1000"),
    ("bailout", lambda v: 0 < v <= MAX_BAILOUT, f"must be above 0 and at most {MAX_BAILOUT:g}"),
    ("distance_bailout", lambda v: 0 < v <= MAX_BAILOUT, f"must be above 0 and at most {MAX_BAILOUT:g}"),
    ("step_scale", lambda v: 0 < v <= 2, "must be above 0 and at most 2"),
)


def _check_derived(bound: BoundFormula, where: Where) -> None:
    """Checks the numbers that follow from the parameters, and names the key that gives a bad one."""
    formula = bound.formula
    for key, accepted, words in _DERIVED:
        node = getattr(formula, key)
        if node is None:
            continue
        value = _located(bound, node, key, where)
        if not accepted(value):
            raise FormulaError(f"{key} {words}, got {value:g}{_with_values(bound)}", where)
    repeat = bound.value(formula.repeat)
    if abs(repeat - round(repeat)) > 1e-9:
        raise FormulaError(f"repeat must be a whole number, got {repeat:g}{_with_values(bound)}", where)
    if formula.derivative is not None and round(repeat) != 1:
        raise FormulaError("a formula with a derivative of its own cannot repeat its map", where)
    for node in formula.bounds_center:
        if not abs(_located(bound, node, "bounds.center", where)) <= MAX_RADIUS:
            raise FormulaError(f"bounds.center must lie within +-{MAX_RADIUS:g}{_with_values(bound)}", where)
    radius = _located(bound, formula.bounds_radius, "bounds.radius", where)
    if not 0 < radius <= MAX_RADIUS:
        words = f"must be above 0 and at most {MAX_RADIUS:g}, got {radius:g}"
        raise FormulaError(f"bounds.radius {words}{_with_values(bound)}", where)


def _located(bound: BoundFormula, node: Node, key: str, where: Where) -> float:
    try:
        return bound.value(node)
    except FormulaError as error:
        raise FormulaError(f"{key} {error.message}{_with_values(bound)}", where) from error


def _with_values(bound: BoundFormula) -> str:
    shown = ", ".join(f"{name} = {value:g}" for name, value in bound.values.items())
    return f" with {shown}" if shown else ""


# One step of `_check_constants`: a key, a function whose last argument is to be looked at, or None for a constant `let`
# that is to be remembered; and the value.
_Step: TypeAlias = tuple[str, str | None, Callable[[Mapping[str, float]], Any]]


@lru_cache(maxsize=256)
def _steps(formula: Formula) -> tuple[_Step, ...]:
    """Divisors and exponents outside the branches of a `where` that parameters alone may decide, and what they use."""
    found: list[_Step] = []
    constant = {parameter.name for parameter in formula.parameters}
    for key, node in (*formula.let, *zip(formula.variables, formula.map, strict=True)):
        guarded = {
            id(p) for w in walk(node) if isinstance(w, Call) and w.function == "where" for p in walk(w)
        }
        for part in walk(node):
            if isinstance(part, Call) and id(part) not in guarded and part.function in _LAST:
                last = part.arguments[-1]
                if names_in(last) <= constant:
                    found.append((key, part.function, as_function(last)))
        if names_in(node) <= constant and key not in formula.variables:
            found.append((key, None, as_function(node)))
            constant.add(key)
    return tuple(found)


# Functions whose last argument must not be zero, or not be large.
_LAST = frozenset(("div", "mod", "pow", "cpow_re", "cpow_im"))


def _check_constants(bound: BoundFormula, where: Where) -> None:
    """Refuses values that make a divisor zero or an exponent huge, outside the branches of a `where`."""
    constants: dict[str, float] = dict(bound.values)
    for key, function, value_of in _steps(bound.formula):
        try:
            value = finite(value_of(constants))
        except (FormulaError, KeyError):
            continue  # no number, or it uses a `let` that is none
        if function is None:
            constants[key] = value
        elif function in ("div", "mod"):
            if value == 0:
                raise FormulaError(f"division by zero in {key!r}{_with_values(bound)}", where)
        elif abs(value) > MAX_EXPONENT:
            raise FormulaError(
                f"an exponent in {key!r} must be at most {MAX_EXPONENT}{_with_values(bound)}", where
            )
