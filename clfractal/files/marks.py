"""Plain data that remembers where each value stands in a text, so that an error can point at it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from clfractal.errors import ClfractalError, SceneError, Where

MAX_DEPTH = 100
MERGE = "<<"
"""The key whose value is a mapping, or a list of them, that a mapping takes over."""
OPTION = "--set "


def option(key: str) -> str:
    """What stands for the file of a value given as an option, `--set camera.fov`."""
    return OPTION + key


def _below(file: str | None, shown: str) -> str:
    """A path as shown after the option that gave the value: without what the option names already."""
    if file is None or not file.startswith(OPTION):
        return shown
    key = file[len(OPTION) :]
    if shown.startswith(key + "."):
        return shown[len(key) + 1 :]
    return "" if f"{key}.".startswith(f"{shown}.") else shown


def dotted(path: Sequence[str | int]) -> str:
    """A path as it is shown: `lights.0.color`; on one line, whatever the keys are."""
    return ".".join(_printable(str(part)) for part in path)


def _printable(part: str) -> str:
    part = part if len(part) <= 60 else part[:57] + "..."
    return part if part.isprintable() else ascii(part)


def split_path(text: str) -> tuple[str, ...]:
    """The parts of a dotted path; `map[0]` is read like `map.0`."""
    return tuple(part for part in re.split(r"[.\[\]]", text) if part)


@dataclass(slots=True)
class Node:
    """A value of the document and where it stands.

    Attributes:
        value: a scalar, `list[Node]` or `dict[str, Node]`.
        file: the name of the text it stands in; in a scene also a formula's own file, or an option.
        line, column: its first character, from 1; None in an option.
        end: the position after its last character, to order errors in the text.
        text_column: the column of a string's first character when its text stands on one line just as it is.
        keys: position of each key of a mapping; also of the key that merges others, which is no key of the value.
        size: the number of nodes it expands to.
    """

    value: Any
    file: str | None
    line: int | None
    column: int | None
    end: tuple[int, int] = (0, 0)
    text_column: int | None = None
    keys: dict[str, tuple[int, int]] = field(default_factory=dict)
    size: int = 1

    def plain(self) -> Any:
        """The value as plain data."""
        if isinstance(self.value, dict):
            return {key: child.plain() for key, child in self.value.items()}
        if isinstance(self.value, list):
            return [child.plain() for child in self.value]
        return self.value

    def child(self, part: str | int) -> Node | None:
        """The value under a key or at an index (which may be a word such as "0"), or None."""
        if isinstance(self.value, dict):
            found = self.value.get(str(part))
            return found if isinstance(found, Node) else None
        if isinstance(self.value, list) and str(part).isdecimal() and int(part) < len(self.value):
            found = self.value[int(part)]
            return found if isinstance(found, Node) else None
        return None

    def under(self, path: Sequence[str | int]) -> Node | None:
        """The value at a path, or None."""
        node: Node | None = self
        for part in path:
            node = node.child(part) if node is not None else None
        return node


@dataclass(frozen=True, slots=True)
class Document:
    """A document's root node, and finding places in it."""

    root: Node

    def plain(self) -> Any:
        """The document as plain data: None, bool, int, float, str, list and dict with string keys."""
        return self.root.plain()

    def where(self, path: Sequence[str | int], *, key: str | None = None, column: int | None = None) -> Where:
        """The place of the value at `path`, of the key `key` in it, or of a column (from 1) in its text.

        The path shown begins in the text that holds the place: in a formula's own file it is `map.0`.
        """
        node, depth, start = self.root, 0, 0
        for part in path:
            child = node.child(part)
            if child is None:
                break
            depth += 1
            if child.file != node.file:
                start = depth
            node = child
        line, place = node.line, node.column
        if depth == len(path):
            if key is not None and key in node.keys:
                line, place = node.keys[key]
            elif key is not None and (child := node.child(key)) is not None:
                node, line, place = child, child.line, child.column
            elif column is not None and node.text_column is not None:
                place = node.text_column + column - 1
        shown = (
            dotted(path) if node.file is not None and node.file.startswith(OPTION) else dotted(path[start:])
        )
        return Where(node.file, line, place, _below(node.file, shown) or None)

    def _with_dots(self, parts: tuple[str, ...]) -> tuple[str, ...]:
        """The path of these parts, of which several may be one key with dots in it."""
        path: list[str] = []
        node: Node | None = self.root
        while parts:
            known = node.value if node is not None and isinstance(node.value, dict) else {}
            fits = [key for key in known if split_path(key) == parts[: len(split_path(key))]]
            key = max(fits, key=len, default=parts[0])
            path.append(key)
            node = node.child(key) if node is not None else None
            parts = parts[max(len(split_path(key)), 1) :]
        return tuple(path)

    def has(self, path: Sequence[str | int]) -> bool:
        """Whether there is a value at `path`."""
        return self.root.under(path) is not None

    def end(self, path: Sequence[str | int]) -> tuple[int, int]:
        """Line and column after the value at `path`, or after what is left of the path."""
        node = self.root
        for part in path:
            child = node.child(part)
            if child is None:
                break
            node = child
        return node.end

    def replaced(self, path: Sequence[str], value: Node) -> Document:
        """The document with `value` at `path`; mappings that do not exist on the way are made.

        Raises:
            SceneError: the path leads through a value without keys, or to an entry that a list does not have.
        """
        return Document(_replaced(self.root, path, 0, value))

    def locate(self, error: ClfractalError) -> ClfractalError:
        """The same error at its place in the text.

        `error.where` holds a dotted path and perhaps a column inside the string at that path, but no file.
        """
        if error.where.file is not None:
            return error
        path = self._with_dots(split_path(error.where.path or ""))
        unknown = re.match(r"unknown \w+ '(.*?)'", error.message)
        key = unknown.group(1) if unknown else None
        if key is not None and path and path[-1] == key:
            named = self.where(path[:-1], key=key)
            where = replace(named, path=self.where(path).path)
        else:
            where = self.where(path, key=key, column=error.where.column)
        return type(error)(error.message, where, details=error.details, status=error.status)


def _replaced(node: Node, path: Sequence[str], depth: int, value: Node) -> Node:
    """A copy of `node` with `value` put in: an alias elsewhere may share the original."""
    if depth == len(path):
        return value
    part, shown = path[depth], dotted(path[: depth + 1])
    child = node.child(part)
    if isinstance(node.value, list):
        if child is None:
            entries = f"entries 0 to {len(node.value) - 1}" if node.value else "no entries"
            raise SceneError(f"{shown} does not exist: the list has {entries}", Where(value.file))
        index = int(part)
        inner: Any = [*node.value[:index], _replaced(child, path, depth + 1, value), *node.value[index + 1 :]]
    elif isinstance(node.value, dict):
        below = child if child is not None and child.value is not None else Node({}, value.file, None, None)
        inner = {**node.value, part: _replaced(below, path, depth + 1, value)}
    else:
        raise SceneError(
            f"{dotted(path[:depth])} is a single value, so it has no key {part!r}", Where(value.file)
        )
    return replace(node, value=inner)


def node_from_plain(value: Any, file: str | None, *, depth: int = 0) -> Node:
    """Plain data as nodes that stand at no line of `file`; SceneError beyond MAX_DEPTH levels."""
    if depth > MAX_DEPTH:
        raise SceneError(f"nested more than {MAX_DEPTH} levels deep", Where(file))
    inner: Any = value
    if isinstance(value, Mapping):
        inner = {str(key): node_from_plain(child, file, depth=depth + 1) for key, child in value.items()}
    elif isinstance(value, (list, tuple)):
        inner = [node_from_plain(child, file, depth=depth + 1) for child in value]
    return Node(inner, file, None, None)
