"""Functions that a formula takes from other files: its key `include`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from clfractal.errors import FileError, FormulaError, Where
from clfractal.files.document import read_document
from clfractal.files.marks import Document, Node, node_from_plain
from clfractal.files.regular import read_text_file
from clfractal.files.resources import folder as resource_folder
from clfractal.formulas.definition import inside
from clfractal.formulas.own import find_own, safe_path

MAX_INCLUDED = 16
_DEEPEST = 4
KEY = "include"


def with_included(
    formula: Node, where: Where, *, folder: Path | None, beside: Path | None, depth: int = 0
) -> Node:
    """A formula with the functions of the files that it includes among its own, before them, and without the key.

    Args:
        where: the place of the formula.
        folder: where files are looked for.
        beside: the scene's folder, in which formulas of one's own are looked for by name.

    Raises:
        FormulaError: no such formula, or one without functions, or files that include each other.
        FileError: a file that cannot be read, or lies outside the folder.
    """
    names = formula.child(KEY)
    if names is None:
        return formula
    here = inside(where, KEY)
    listed = names.plain()
    if (
        not isinstance(listed, list)
        or len(listed) > MAX_INCLUDED
        or not all(isinstance(n, str) for n in listed)
    ):
        raise FormulaError(f"must be a list of up to {MAX_INCLUDED} names of formulas, or files", here)
    if depth >= _DEEPEST:
        raise FormulaError(f"files include each other more than {_DEEPEST} deep", here)
    functions: dict[str, Node] = {}
    for index, name in enumerate(listed):
        at = inside(here, str(index))
        path, shown, within = _found(name, at, folder, beside)
        try:
            root = read_document(read_text_file(path, name=shown), shown, error=FormulaError).root
        except FileError as error:
            raise FileError(error.inside(shown), at) from error
        root = with_included(root, at, folder=within, beside=beside, depth=depth + 1)
        found = root.child("functions")
        if found is None or not isinstance(found.value, dict):
            raise FormulaError(f"{name!r} has no `functions`", at)
        functions |= found.value
    own = formula.child("functions")
    if own is not None and not isinstance(own.value, dict):
        raise FormulaError("functions must be a mapping of keys to values", inside(where, "functions"))
    functions |= own.value if own is not None else {}
    value = {key: child for key, child in formula.value.items() if key != KEY}
    value["functions"] = replace(own if own is not None else names, value=functions)
    return replace(formula, value=value)


def plain_with_included(data: Any, where: Where, *, folder: Path | None, beside: Path | None) -> Any:
    """The same of plain data."""
    if not isinstance(data, dict) or KEY not in data:
        return data
    node = node_from_plain(data, where.file or "")
    return with_included(node, where, folder=folder, beside=beside).plain()


def document_with_included(
    document: Document, where: Where, *, folder: Path | None, beside: Path | None
) -> Document:
    """The same of a document."""
    return Document(with_included(document.root, where, folder=folder, beside=beside))


def _found(
    name: str, where: Where, folder: Path | None, beside: Path | None
) -> tuple[Path, str, Path | None]:
    """A file's path, the name that is shown, and the folder for files that it names."""
    if name.endswith((".yaml", ".yml")):
        if folder is None:
            raise FormulaError("a file needs a folder in which it is looked for: name a formula", where)
        path = safe_path(name, folder, where)
        return path, name, folder
    own = find_own(name, beside, where)
    if own is None:
        path = Path(str(resource_folder("formulas/library"))) / f"{name}.yaml"
        return path, f"{name}.yaml", None
    return own, str(own), own.resolve().parent
