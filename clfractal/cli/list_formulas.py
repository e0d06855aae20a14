"""`clfractal formulas`: the library and the formulas of one's own, as text."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from clfractal.errors import ClfractalError
from clfractal.formulas import catalog
from clfractal.formulas.jumps import jumps_of
from clfractal.formulas.language import Formula, Parameter
from clfractal.formulas.own import own_files

_WIDTH = 100
_MOST_JUMPS = 8


def list_formulas() -> str:
    """A line for each formula: name and title; those of one's own after the library's, with their files.

    Raises:
        FileError: a folder of CLFRACTAL_FORMULAS is not there.
    """
    names, own = catalog.names(), own_files(Path())
    column = max(map(len, (*names, *own))) + 2
    lines = [f"{name:{column}}{_line(catalog.description(name).get('title', ''))}" for name in names]
    for path in dict.fromkeys(path.parent for path in own.values()):
        lines.append(f"\nin {path}:")
        lines += [f"{name:{column}}{_title(name)[1]}" for name, file in own.items() if file.parent == path]
    return "\n".join(lines)


def _title(name: str) -> tuple[str, str]:
    """The title of a formula of one's own, or what is wrong with it, with the word for that."""
    try:
        return "title", _line(catalog.described(name, Path())[1].title)
    except ClfractalError as error:
        return "problem", _line(error)


def facts_of_all() -> list[dict[str, Any]]:
    """The same as plain data: name, title and file of each, which is null for the library's.

    `problem` is there only where a formula of one's own is wrong, which then has no title.

    Raises:
        FileError: a folder of CLFRACTAL_FORMULAS is not there.
    """
    return [
        *(
            {"name": name, "title": _line(catalog.description(name).get("title", "")), "file": None}
            for name in catalog.names()
        ),
        *(
            {"name": name, "title": None, "file": str(path), **dict([_title(name)])}
            for name, path in own_files(Path()).items()
        ),
    ]


def facts_of(name: str) -> dict[str, Any]:
    """What `tell_formula` tells as plain data; errors as there.

    A chain has its links as its file has them; any other formula has its variables, what it adds, and its parameters.
    """
    data, chain = catalog.described(name, Path())
    found: dict[str, Any] = {
        "name": name,
        "title": _line(data.get("title", name)),
        "reference": _line(data["reference"]) if data.get("reference") else None,
        "description": _line(data["description"]) if data.get("description") else None,
    }
    if "chain" in data:
        return {**found, "chain": [dict(link) for link in data["chain"]]}
    formula = chain.first.formula
    return {
        **found,
        "variables": list(formula.variables),
        "add": formula.add,
        "parameters": [
            {
                "name": each.name,
                "type": each.type,
                "default": each.default,
                "choices": list(each.choices) if each.choices else None,
                "minimum": each.minimum,
                "maximum": each.maximum,
                "description": _line(each.description) or None,
            }
            for each in formula.parameters
        ],
    }


def tell_formula(name: str) -> str:
    """Title, reference, description and parameters of one formula.

    Raises:
        FormulaError: there is none of that name, or it is wrong.
        FileError: it cannot be read.
    """
    data, chain = catalog.described(name, Path())
    links = "".join(f"\n  {_link(link)}" for link in data.get("chain", ()))
    parts = [
        f"{name}: {_line(data.get('title', name))}",
        f"reference: {_line(data.get('reference', 'none'))}",
        *([textwrap.fill(_line(data["description"]), _WIDTH)] if data.get("description") else []),
        *([f"a chain, in turn:{links}"] if "chain" in data else _formula(chain.first.formula)),
    ]
    return "\n\n".join(parts)


def _formula(formula: Formula) -> list[str]:
    each = "".join(f"\n  {_parameter(parameter)}" for parameter in formula.parameters)
    jumps = jumps_of(formula)[:_MOST_JUMPS] if formula.grown else ()
    return [
        f"variables: {', '.join(formula.variables)}; adds: {formula.add}",
        *([f"carries: {', '.join(number.name for number in formula.state)}"] if formula.state else []),
        f"parameters:{each or ' none'}",
        *([f"no slope where this changes: {', '.join(jumps)}"] if jumps else []),
    ]


def _parameter(parameter: Parameter) -> str:
    kind = {"int": "whole number", "real": "number"}[parameter.type]
    choices = ", ".join(f"{choice:g}" for choice in parameter.choices or ())
    parts = [
        f"{parameter.name}: {kind}, default {parameter.default:g}",
        f", one of {choices}" if choices else "",
        f", at least {parameter.minimum:g}" if parameter.minimum is not None else "",
        f", at most {parameter.maximum:g}" if parameter.maximum is not None else "",
        f"; {_line(parameter.description)}" if parameter.description else "",
    ]
    return "".join(parts)


def _link(link: Mapping[str, Any]) -> str:
    name = link.get("name") or link.get("file") or "inline formula"
    count = int(link.get("count", 1))
    settings = ", ".join(f"{key} {value:g}" for key, value in (link.get("parameters") or {}).items())
    when = "".join(f", {key} {link[key]}" for key in ("start", "stop") if link.get(key) is not None)
    return f"{name} x {count}{when}" + (f" ({settings})" if settings else "")


def _line(text: object) -> str:
    return " ".join(str(text).split())
