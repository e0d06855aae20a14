"""Reads the parameters of a formula file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from clfractal.errors import FormulaError, Where, unknown_name
from clfractal.formulas.definition import Parameter, inside
from clfractal.formulas.names import as_mapping, check_keys, check_name

MAX_PARAMETERS = 128
_PARAMETER_KEYS = ("type", "default", "minimum", "maximum", "choices", "baked", "description")


def parameters_from_mapping(data: object, variables: Sequence[str], where: Where) -> tuple[Parameter, ...]:
    """All parameters, in the order of the file.

    Raises:
        FormulaError: a name that is taken, an unknown key, a default out of range, and so on.
    """
    mapping = as_mapping(data, where, "parameters")
    if len(mapping) > MAX_PARAMETERS:
        raise FormulaError(f"must be at most {MAX_PARAMETERS}, got {len(mapping)}", where)
    found = []
    for name, value in mapping.items():
        here = inside(where, str(name))
        check_name(name, variables, here)
        found.append(_parameter(name, value, here))
    return tuple(found)


def _parameter(name: str, value: object, where: Where) -> Parameter:
    """A parameter from its mapping, or from a plain number (a real one with this default)."""
    data = value if isinstance(value, Mapping) else {"default": value}
    check_keys(data, _PARAMETER_KEYS, where)
    kind = data.get("type", "real")
    if kind not in ("int", "real"):
        raise FormulaError(unknown_name("type", str(kind), ("int", "real")), inside(where, "type"))
    if "default" not in data:
        raise FormulaError("lacks the key 'default'", where)
    plain = Parameter(name, kind, 0.0)
    number = {
        key: plain.check(data[key], inside(where, key)) if key in data else None
        for key in ("minimum", "maximum", "default")
    }
    baked = data.get("baked", kind == "int")
    if not isinstance(baked, bool):
        raise FormulaError("must be true or false", inside(where, "baked"))
    choices = data.get("choices")
    if choices is not None:
        here = inside(where, "choices")
        if not isinstance(choices, (list, tuple)) or not choices:
            raise FormulaError("must be a list of numbers", here)
        choices = tuple(plain.check(choice, inside(here, str(i))) for i, choice in enumerate(choices))
    description = data.get("description", "")
    if not isinstance(description, str):
        raise FormulaError("must be text", inside(where, "description"))
    default = number["default"] or 0.0
    parameter = Parameter(
        name, kind, default, number["minimum"], number["maximum"], choices, baked, description
    )
    parameter.check(default, inside(where, "default"))
    return parameter
