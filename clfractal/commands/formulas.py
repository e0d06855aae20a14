"""`clfractal formulas`: the library, as text."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

from clfractal.formulas import catalog
from clfractal.formulas.language import Formula, Parameter

_WIDTH = 100


def list_formulas() -> str:
    """A line for each formula: name and title."""
    names = catalog.names()
    column = max(map(len, names)) + 2
    return "\n".join(f"{name:{column}}{_line(catalog.description(name).get('title', ''))}" for name in names)


def tell_formula(name: str) -> str:
    """Title, reference, description and parameters of one formula.

    Raises:
        FormulaError: there is none of that name.
    """
    data = catalog.description(name)
    parts = [f"{name}: {_line(data.get('title', ''))}", f"reference: {_line(data.get('reference', ''))}"]
    if data.get("description"):
        parts.append(textwrap.fill(_line(data["description"]), _WIDTH))
    if catalog.is_chain(name):
        parts.append("a chain, in turn:\n" + "\n".join(f"  {_link(link)}" for link in data["chain"]))
    else:
        parts += _formula(catalog.load(name))
    return "\n\n".join(parts)


def _formula(formula: Formula) -> list[str]:
    parts = [f"variables: {', '.join(formula.variables)}; adds: {formula.add}"]
    if formula.parameters:
        parts.append("parameters:\n" + "\n".join(f"  {_parameter(each)}" for each in formula.parameters))
    else:
        parts.append("parameters: none")
    return parts


def _parameter(parameter: Parameter) -> str:
    kind = {"int": "whole number", "real": "number"}[parameter.type]
    text = f"{parameter.name}: {kind}, default {parameter.default:g}"
    if parameter.choices:
        text += ", one of " + ", ".join(f"{choice:g}" for choice in parameter.choices)
    if parameter.minimum is not None:
        text += f", at least {parameter.minimum:g}"
    if parameter.maximum is not None:
        text += f", at most {parameter.maximum:g}"
    return f"{text}; {_line(parameter.description)}" if parameter.description else text


def _link(link: Mapping[str, Any]) -> str:
    name = link.get("name", "inline formula")
    count = int(link.get("count", 1))
    settings = ", ".join(f"{key} {value:g}" for key, value in (link.get("parameters") or {}).items())
    return f"{name} x {count}" + (f" ({settings})" if settings else "")


def _line(text: object) -> str:
    return " ".join(str(text).split())
