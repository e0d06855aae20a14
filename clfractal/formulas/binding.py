"""Binds a formula to parameter values, and refuses values that give it no meaning."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from clfractal.errors import FormulaError, Where, unknown_name
from clfractal.formulas.evaluate import MAX_EXPONENT, evaluate_constant
from clfractal.formulas.model import MAX_REPEAT, BoundFormula, Formula, inside
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
) -> BoundFormula:
    """The formula with values for its parameters; what is not given has its default.

    `julia` (one number for each variable) adds this constant in place of the point.

    Raises:
        FormulaError: an unknown parameter, a value out of range, a julia of the wrong length, or values that
        give the
            formula no meaning (no whole repeat, a degree below 1, a division by zero). Its place is `where`'s
            path with `.parameters.NAME`, `.julia`, `.bailout`.
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
    ("step_scale", lambda v: 0 < v <= 1, "must be above 0 and at most 1"),
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


def _check_constants(bound: BoundFormula, where: Where) -> None:
    """Refuses values that make a divisor zero or an exponent huge, outside the branches of a `where`."""
    constants: dict[str, float] = dict(bound.values)
    for key, node in [
        *bound.formula.let,
        *((v, m) for v, m in zip(bound.formula.variables, bound.formula.map, strict=True)),
    ]:
        guarded = {
            id(p) for w in walk(node) if isinstance(w, Call) and w.function == "where" for p in walk(w)
        }
        for part in walk(node):
            if not isinstance(part, Call) or id(part) in guarded:
                continue
            last = _constant(part.arguments[-1], constants)
            if part.function in ("div", "mod") and last == 0:
                raise FormulaError(f"division by zero in {key!r}{_with_values(bound)}", where)
            if (
                part.function in ("pow", "cpow_re", "cpow_im")
                and last is not None
                and abs(last) > MAX_EXPONENT
            ):
                raise FormulaError(
                    f"an exponent in {key!r} must be at most {MAX_EXPONENT}{_with_values(bound)}", where
                )
        value = _constant(node, constants)
        if value is not None and key not in bound.formula.variables:
            constants[key] = value


def _constant(node: Node, constants: Mapping[str, float]) -> float | None:
    if names_in(node) <= constants.keys():
        try:
            return evaluate_constant(node, constants)
        except FormulaError:
            return None
    return None
