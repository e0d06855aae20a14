"""Reads YAML from anybody into plain data, keeping the line and column of every value; the only file that knows yaml.

The document is built from the parser's events rather than by a loader: nothing recurses, nothing is constructed but
strings, numbers, booleans, lists and mappings, and an alias is counted for all that it expands to before it is used.
"""

from __future__ import annotations

import math
import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import yaml

from clfractal.errors import ClfractalError, FileError, SceneError, Where

MAX_BYTES = 1_000_000
MAX_NODES = 100_000
MAX_DEPTH = 100
MAX_NUMBER_LENGTH = 40

_Parser = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_INT = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NON_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_WORDS: Mapping[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}


@dataclass(slots=True)
class Node:
    """A value of the document and where it stands.

    Attributes:
        value: a scalar, `list[Node]` or `dict[str, Node]`.
        file: the name of the text it stands in (a scene may hold nodes of a formula's own file, or of an option).
        line, column: its first character, from 1; None in an option.
        end: the position after its last character, to order errors in the text.
        text_column: the column of a string's first character when its text stands on one line just as it is.
        keys: position of each key of a mapping.
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


@dataclass(frozen=True, slots=True)
class Document:
    """A document's root node, and finding places in it."""

    root: Node

    def plain(self) -> Any:
        """The document as plain data: None, bool, int, float, str, list and dict with string keys."""
        return self.root.plain()

    def find(self, path: Sequence[str | int]) -> tuple[Node, int]:
        """The deepest node along `path` that exists, and how many parts of the path lead there."""
        node, depth = self.root, 0
        for part in path:
            child = node.child(part)
            if child is None:
                break
            node, depth = child, depth + 1
        return node, depth

    def where(self, path: Sequence[str | int], *, key: str | None = None, column: int | None = None) -> Where:
        """The place of the value at `path`, or of the key `key` in it, or of a column (from 1) in its text."""
        node, depth = self.find(path)
        line, place = node.line, node.column
        if depth == len(path):
            if key is not None and key in node.keys:
                line, place = node.keys[key]
            elif column is not None and node.text_column is not None:
                place = node.text_column + column - 1
        return Where(node.file, line, place, dotted(path) or None)

    def locate(self, error: ClfractalError) -> ClfractalError:
        """The same error at its place in the text.

        `error.where` holds a dotted path and perhaps a column inside the string at that path, but no file.
        """
        if error.where.file is not None:
            return error
        path = split_path(error.where.path or "")
        unknown = re.match(r"unknown key '(.*?)'", error.message)
        key = unknown.group(1) if unknown else None
        where = self.where(path, key=key, column=error.where.column)
        return type(error)(error.message, where, details=error.details, status=error.status)


def dotted(path: Sequence[str | int]) -> str:
    """A path as it is shown: `lights.0.color`."""
    return ".".join(str(part) for part in path)


def split_path(text: str) -> tuple[str, ...]:
    """The parts of a dotted path; `map[0]` is read like `map.0`."""
    return tuple(part for part in re.split(r"[.\[\]]", text) if part)


def check_regular(descriptor: int, name: str, limit: int | None) -> None:
    """Refuses what is no regular file (a device could be read for ever), and a file above `limit` bytes."""
    status = os.fstat(descriptor)
    if stat.S_ISDIR(status.st_mode):
        raise FileError("is a folder, not a file", Where(name))
    if not stat.S_ISREG(status.st_mode):
        raise FileError("is not a regular file", Where(name))
    if limit is not None and status.st_size > limit:
        raise FileError(f"is too large: {status.st_size:,} bytes, at most {limit:,}", Where(name))


def read_bytes(
    path: Path, *, name: str | None = None, limit: int = MAX_BYTES, prefix: int | None = None
) -> bytes:
    """The bytes of a regular file, at most `limit`; only the first `prefix` ones, of a file of any size, if given.

    Raises:
        FileError: it cannot be read, is no regular file, or is too large.
    """
    shown = name or str(path)
    try:
        # Without O_NONBLOCK opening a FIFO would wait for a writer.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise FileError(f"cannot be read: {reason}", Where(shown)) from error
    try:
        check_regular(descriptor, shown, None if prefix is not None else limit)
        with os.fdopen(descriptor, "rb", closefd=False) as stream:
            content = stream.read(prefix if prefix is not None else limit + 1)
    except OSError as error:
        raise FileError(f"cannot be read: {error.strerror}", Where(shown)) from error
    finally:
        os.close(descriptor)
    if prefix is None and len(content) > limit:
        raise FileError(f"is too large: at most {limit:,} bytes", Where(shown))
    return content


def decode(content: bytes, name: str) -> str:
    """UTF-8 text, or a FileError naming the line with the first byte that is none."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise FileError("is not UTF-8 text", Where(name, line)) from error


def read_text_file(path: Path, *, name: str | None = None, limit: int = MAX_BYTES) -> str:
    """The text of a regular file of at most `limit` bytes; FileError otherwise."""
    return decode(read_bytes(path, name=name, limit=limit), name or str(path))


def read_document(
    text: str, file: str | None = None, *, error: type[ClfractalError] = SceneError
) -> Document:
    """Parses one YAML document.

    Numbers, booleans and null follow YAML 1.2's core schema (`1e-3` is a number, `yes` and `1:30` are words).

    Raises:
        error: not YAML, not one document, a duplicate key, a tag, a number that is not finite, an alias that
            contains itself, or more than MAX_BYTES of text, MAX_NODES values or MAX_DEPTH levels.
    """
    return Document(_Builder(file, error).build(text))


def read_value(text: str, file: str) -> Node:
    """A value written in an option: every place in it is `file` alone, without line and column.

    Raises:
        SceneError: as for read_document.
    """
    try:
        root = read_document(text, file).root
    except SceneError as error:
        raise SceneError(error.message, Where(file), details=error.details) from error
    return node_from_plain(root.plain(), file)


def node_from_plain(value: Any, file: str | None) -> Node:
    """Plain data as nodes that stand at no line of `file`."""
    if isinstance(value, Mapping):
        return Node(
            {str(key): node_from_plain(child, file) for key, child in value.items()}, file, None, None
        )
    if isinstance(value, (list, tuple)):
        return Node([node_from_plain(child, file) for child in value], file, None, None)
    return Node(value, file, None, None)


@dataclass(slots=True)
class _Open:
    """A list or mapping that is being read."""

    node: Node
    anchor: str | None
    key: str | None = None


class _Builder:
    """Builds the nodes of one document from the events of the parser."""

    def __init__(self, file: str | None, error: type[ClfractalError]) -> None:
        self.file = file
        self.error = error
        self.root: Node | None = None
        self.stack: list[_Open] = []
        self.anchors: dict[str, Node] = {}
        self.count = 0

    def fail(self, message: str, line: int, column: int | None) -> NoReturn:
        path = dotted([p for p in (self._part(open_) for open_ in self.stack) if p is not None])
        raise self.error(message, Where(self.file, line, column, path or None))

    def fail_at(self, message: str, event: Any) -> NoReturn:
        self.fail(message, event.start_mark.line + 1, event.start_mark.column + 1)

    def build(self, text: str) -> Node:
        try:
            if len(text.encode()) > MAX_BYTES:
                raise self.error(f"is too large: at most {MAX_BYTES:,} bytes", Where(self.file))
        except UnicodeEncodeError as error:
            raise self.error("is not UTF-8 text", Where(self.file)) from error
        documents = 0
        for event in self._events(text):
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    self.fail_at("only one YAML document is allowed in a file", event)
            elif isinstance(event, yaml.NodeEvent):
                self._node(event)
            elif isinstance(event, yaml.CollectionEndEvent):
                self._close(event)
        if self.root is None:
            raise self.error("is empty", Where(self.file, 1, 1))
        return self.root

    def _events(self, text: str) -> Iterator[Any]:
        try:
            yield from yaml.parse(text, Loader=_Parser)
        except yaml.reader.ReaderError as error:
            line = text.encode().count(b"\n", 0, error.position) + 1
            raise self.error("holds a character that YAML does not allow", Where(self.file, line)) from error
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            place = Where(self.file, mark.line + 1, mark.column + 1) if mark else Where(self.file)
            problem = error.problem or error.context or "cannot be read"
            raise self.error(f"not valid YAML: {problem}", place) from error
        except (yaml.YAMLError, ValueError) as error:
            raise self.error(f"not valid YAML: {str(error)[:200]}", Where(self.file)) from error

    def _node(self, event: Any) -> None:
        top = self.stack[-1] if self.stack else None
        if top is not None and isinstance(top.node.value, dict) and top.key is None:
            self._key(top, event)
            return
        if isinstance(event, yaml.AliasEvent):
            self._add(self._alias(event))
            return
        if event.tag is not None and event.tag != "!":
            self.fail_at(f"tags are not allowed, got {event.tag[:60]!r}", event)
        if len(self.stack) >= MAX_DEPTH:
            self.fail_at(f"nested more than {MAX_DEPTH} levels deep", event)
        line, column = event.start_mark.line + 1, event.start_mark.column + 1
        node = Node(None, self.file, line, column, (event.end_mark.line + 1, event.end_mark.column + 1))
        if isinstance(event, yaml.ScalarEvent):
            node.value = self._scalar(event)
            node.text_column = _text_column(event)
            if event.anchor:
                self.anchors[event.anchor] = node
            self._add(node)
            return
        self._count(1, event)
        node.value = [] if isinstance(event, yaml.SequenceStartEvent) else {}
        self.stack.append(_Open(node, event.anchor))
        if event.anchor:
            self.anchors.pop(event.anchor, None)

    def _key(self, top: _Open, event: Any) -> None:
        if not isinstance(event, yaml.ScalarEvent) or (event.tag is not None and event.tag != "!"):
            self.fail_at("a key must be a word", event)
        if event.anchor:
            self.fail_at("an anchor on a key is not allowed", event)
        if event.value in top.node.value:
            first = top.node.keys[event.value][0]
            self.fail_at(f"duplicate key {event.value[:60]!r}, first on line {first}", event)
        top.key = event.value
        top.node.keys[event.value] = (event.start_mark.line + 1, event.start_mark.column + 1)

    def _alias(self, event: Any) -> Node:
        name = event.anchor
        if any(open_.anchor == name for open_ in self.stack):
            self.fail_at(f"the alias *{name[:60]} contains itself", event)
        if name not in self.anchors:
            self.fail_at(f"unknown alias *{name[:60]}", event)
        node = self.anchors[name]
        self._count(node.size, event)
        if len(self.stack) + _depth(node) > MAX_DEPTH:
            self.fail_at(f"nested more than {MAX_DEPTH} levels deep", event)
        return node

    def _count(self, size: int, event: Any) -> None:
        self.count += size
        if self.count > MAX_NODES:
            self.fail_at(f"holds more than {MAX_NODES:,} values, aliases counted for what they repeat", event)

    def _add(self, node: Node) -> None:
        """Puts a finished node into the list or mapping that is open; the last one is the document."""
        if not self.stack:
            self.root = node
            return
        top = self.stack[-1]
        if isinstance(top.node.value, list):
            top.node.value.append(node)
        else:
            top.node.value[top.key] = node
            top.key = None
        top.node.size += node.size

    def _close(self, event: Any) -> None:
        open_ = self.stack.pop()
        open_.node.end = (event.end_mark.line + 1, event.end_mark.column + 1)
        if open_.anchor:
            self.anchors[open_.anchor] = open_.node
        self._add(open_.node)

    def _scalar(self, event: Any) -> Any:
        self._count(1, event)
        text = event.value
        if not event.implicit[0]:
            return text
        if text in _WORDS:
            return _WORDS[text]
        if _NON_FINITE.fullmatch(text):
            self.fail_at(f"must be a finite number, got {text}", event)
        whole = _INT.fullmatch(text) is not None
        if not whole and not _FLOAT.fullmatch(text):
            return text
        if len(text) > MAX_NUMBER_LENGTH:
            self.fail_at(f"a number of more than {MAX_NUMBER_LENGTH} characters", event)
        number = int(text) if whole else float(text)
        if not math.isfinite(number):
            self.fail_at(f"must be a finite number, got {text}", event)
        return number

    def _part(self, open_: _Open) -> str | int | None:
        return len(open_.node.value) if isinstance(open_.node.value, list) else open_.key


def _depth(node: Node) -> int:
    """Levels of lists and mappings below and with a node (nodes are at most MAX_DEPTH deep)."""
    depth, level = 0, [node]
    while level:
        children: dict[int, Node] = {}
        for parent in level:
            value = parent.value
            inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
            children.update((id(child), child) for child in inner)
        level = list(children.values())
        depth += 1
    return depth


def _text_column(event: Any) -> int | None:
    start, end = event.start_mark, event.end_mark
    quote = 1 if event.style in ("'", '"') else 0
    if start.line != end.line or end.column - start.column != len(event.value) + 2 * quote:
        return None
    return int(start.column) + 1 + quote
