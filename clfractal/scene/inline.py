"""Puts the formula files that a scene names into the scene, so that one text contains everything."""

from dataclasses import replace
from pathlib import Path

from clfractal.errors import ClfractalError, FileError, FormulaError, Where
from clfractal.files.document import read_document
from clfractal.files.marks import Document, Node
from clfractal.files.regular import read_text_file
from clfractal.scene.formula import MAX_LINKS

_INCLUDE = "include"
_SOURCES = ("name", "file", "inline", "chain")
# formula.chain.0.inline: a file may hold a chain whose links are files again. Deeper ones are left for the schema,
# which refuses them.
_DEEPEST = 3


def inlined(document: Document, folder: Path) -> Document:
    """The document with `inline` in the place of every `file` of its formulas, and of the links of their chains.

    So it is for a `name` of a formula of one's own. A formula that the schema will refuse is left as it is.

    Raises:
        FileError: a file cannot be read, or lies outside the folder.
        FormulaError: a file is not YAML, or there is no formula of a name.
    """
    for path in _formulas(document):
        formula = document.root.under(path)
        if formula is None:
            continue
        try:
            changed = _without_files(formula, path, folder, folder)
        except ClfractalError as error:
            raise document.locate(error) from error
        if changed is not formula:
            document = document.replaced(path, changed)
    return document


def _formulas(document: Document) -> list[tuple[str, ...]]:
    """Where formulas stand: the scene's own, and those of objects."""
    objects = document.root.child("objects")
    names = objects.value if objects is not None and isinstance(objects.value, dict) else {}
    return [("formula",), *(("objects", name, "formula") for name in names)]


def _without_files(node: Node, path: tuple[str, ...], folder: Path, beside: Path) -> Node:
    """A mapping that has one of `file`, `name` and `chain`, with texts in the place of files; any other node as it is.

    Args:
        folder: where files are looked for: that of the scene, or of the formula of one's own that names them.
        beside: the scene's folder, in which formulas of one's own are looked for by name.
    """
    given = {word: node.child(word) for word in _SOURCES}
    sources = [word for word, child in given.items() if child is not None and child.value is not None]
    source = node.child(sources[0]) if len(sources) == 1 else None
    if source is None:
        return node
    if isinstance(source.value, str) and source.value and sources[0] in ("file", "name"):
        given_as = sources[0]
        text = (_read if given_as == "file" else _read_own)(source, path, folder, beside)
        if text is None:
            return node
        inner = {"inline" if key == given_as else key: child for key, child in node.value.items()}
        inner["inline"] = text
        keys = {"inline" if key == given_as else key: place for key, place in node.keys.items()}
        return replace(node, value=inner, keys=keys)
    if sources == ["inline"] and isinstance(source.value, dict) and _INCLUDE in source.value:
        from clfractal.formulas.include import with_included

        merged = with_included(source, Where(path=".".join((*path, "inline"))), folder=folder, beside=beside)
        return replace(node, value={**node.value, "inline": merged})
    if sources == ["chain"] and isinstance(source.value, list) and len(source.value) <= MAX_LINKS:
        links = [
            _without_files(link, (*path, "chain", str(i)), folder, beside)
            for i, link in enumerate(source.value)
        ]
        if all(new is old for new, old in zip(links, source.value, strict=True)):
            return node
        return replace(node, value={**node.value, "chain": replace(source, value=links)})
    return node


def _read(file: Node, path: tuple[str, ...], folder: Path, beside: Path) -> Node | None:
    """The text of a formula file as a node, files that it names read too."""
    from clfractal.formulas.own import safe_path

    where = Where(path=".".join((*path, "file")))
    found = safe_path(file.value, folder, where)
    return _text(found, str(folder / file.value), where, path, folder, beside)


def _read_own(name: Node, path: tuple[str, ...], folder: Path, beside: Path) -> Node | None:
    """The same for a name of a formula of one's own; None for a name of the library."""
    from clfractal.formulas.own import find_own

    where = Where(path=".".join((*path, "name")))
    found = find_own(name.value, beside, where)
    return None if found is None else _text(found, str(found), where, path, found.resolve().parent, beside)


def _text(found: Path, shown: str, where: Where, path: tuple[str, ...], folder: Path, beside: Path) -> Node:
    from clfractal.formulas.include import with_included

    try:
        text = read_text_file(found, name=shown)
    except FileError as error:
        raise FileError(error.inside(shown), where) from error
    read = read_document(text, shown, error=FormulaError)
    try:
        root = with_included(read.root, Where(), folder=folder, beside=beside)
    except ClfractalError as error:
        raise read.locate(error) from error
    depth = len(path) - (2 if path[0] == "objects" else 0)
    return _without_files(root, (*path, "inline"), folder, beside) if depth < _DEEPEST else root
