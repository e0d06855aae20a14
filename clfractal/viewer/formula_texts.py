"""The texts of formulas that were typed in the window, so that they are saved and shown as typed."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

from clfractal.errors import FileError, SceneError, Where
from clfractal.files import spans
from clfractal.files.atomic import atomic_writer, check_output
from clfractal.files.document import read_document
from clfractal.files.fragments import same
from clfractal.files.spans import UnusualError
from clfractal.viewer.own_files import is_own

EXTENSIONS = (".yaml", ".yml")
_MOST = 100
_INDENT = "  "


class FormulaTexts:
    """Remembers the text that each formula was typed as."""

    def __init__(self) -> None:
        self._known: list[tuple[Any, str]] = []
        self._files: list[tuple[Any, Path]] = []

    def remember(self, content: Any, text: str) -> None:
        """A formula, as a scene's `inline`, was typed as this text."""
        self._known = [(each, known) for each, known in self._known if not same(each, content)]
        self._known.append((content, text))
        del self._known[:-_MOST]

    def text_of(self, content: Any) -> str | None:
        """The text of a formula; None if it was not typed here."""
        return next((text for each, text in self._known if same(each, content)), None)

    def save(self, content: Any, text: str, path: Path, *, even_if_there: bool = False) -> None:
        """Writes a formula into a file of its own; scenes that are saved in its folder, or above it, name it from now on.

        Raises:
            FileError: it comes with the program, is there already, is no YAML file, or cannot be written.
        """
        where = Where(str(path))
        check_output(path, EXTENSIONS)
        if is_own(path):
            raise FileError("comes with the program and is never overwritten; choose another name", where)
        if path.exists() and not even_if_there:
            raise FileError("is there already; once more replaces it", where)
        with atomic_writer(path) as beside:
            beside.write_bytes(text.encode())
        self._files = [(each, known) for each, known in self._files if known != path]
        self._files.append((content, path.absolute()))
        self.remember(content, text)

    def named(self, folder: Path) -> list[tuple[Any, str]]:
        """Formulas that were saved as files of their own, and the names of these from a scene's folder."""
        home = folder.absolute()
        return [
            (content, path.relative_to(home).as_posix())
            for content, path in reversed(self._files)
            if path.is_relative_to(home) and path.exists()
        ]


def formula_text_in(text: str) -> tuple[Any, str] | None:
    """The formula that a scene's text holds, and the piece of the text that it stands in, not indented.

    None if it holds none over several lines.
    """
    found = _inline(text)
    if found is None:
        return None
    formula, place = found
    value, colon = formula.values[place], formula.colons[place]
    if not isinstance(value, spans.Mapping) or value.flow or value.anchor or colon < 0:
        return None
    piece = textwrap.dedent(text[text.find("\n", colon) + 1 : _end(text, value)]).rstrip() + "\n"
    try:
        return read_document(piece).plain(), piece
    except SceneError:
        return None


def with_formula_text(text: str, formula: str) -> str:
    """A scene's text, whose formula is written out in it, with the formula's own text in that place."""
    found = _inline(text)
    if found is None:
        return text
    section, place = found
    if section.anchor:
        return text
    value, colon = section.values[place], section.colons[place]
    if not section.flow:
        if colon < 0 or getattr(value, "anchor", None):
            return text
        column = section.keys[place].start - (text.rfind("\n", 0, section.keys[place].start) + 1)
        block = textwrap.indent(formula.rstrip(), " " * column + _INDENT)
        end = _end(text, value) if isinstance(value, spans.Mapping) and not value.flow else value.end
        return f"{text[: colon + 1]}\n{block}{text[end:]}"
    lines = []
    for key, each in zip(section.keys, section.values, strict=True):
        if key.value == "inline":
            lines += [f"{_INDENT}inline:", textwrap.indent(formula.rstrip(), 2 * _INDENT)]
        else:
            lines.append(f"{_INDENT}{text[key.start : key.end]}: {text[each.start : each.end]}")
    return f"{text[: section.start].rstrip(' ')}\n" + "\n".join(lines) + text[section.end :]


def _end(text: str, value: spans.Mapping) -> int:
    """Where a mapping over several lines ends, with the comments behind it and below it that are indented as it is."""
    column = value.start - (text.rfind("\n", 0, value.start) + 1)
    end = value.end
    for number, line in enumerate(text[value.end :].split("\n")):
        words = line.strip()
        if number and not (words.startswith("#") and len(line) - len(line.lstrip()) >= column):
            break
        if words and not words.startswith("#"):
            break
        end += len(line) + (number > 0)
    return end


def _inline(text: str) -> tuple[spans.Mapping, int] | None:
    """The formula section of a scene's text, and where its key `inline` is."""
    try:
        root = spans.parse(text)
    except UnusualError:
        return None
    for key, value in zip(root.keys, root.values, strict=True):
        if key.value == "formula" and isinstance(value, spans.Mapping):
            names = [each.value for each in value.keys]
            return (value, names.index("inline")) if "inline" in names else None
    return None
