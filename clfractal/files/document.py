"""Reads untrusted YAML into plain data with line and column, and writes YAML.

A document is built from the parser's events rather than by a loader: there is no recursion, only
strings, numbers, booleans, lists and mappings are constructed, and an alias is counted as all the values that it expands
to before it is used. The key `<<` merges other mappings into its own, as in YAML 1.1.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

import yaml

from clfractal.errors import ClfractalError, SceneError, Where
from clfractal.files.marks import MAX_DEPTH, MERGE, Document, Node, dotted, node_from_plain
from clfractal.files.regular import MAX_BYTES, read_text_file

__all__ = ["MAX_DEPTH", "MAX_NODES", "read_document", "read_text_file", "read_value", "write_document"]

MAX_NODES = 100_000
MAX_NUMBER_LENGTH = 40

PARSER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""What cuts a text into events."""
_INT = re.compile(r"[-+]?[0-9]+")
_OTHER_BASES = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NON_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
# A colour without quotes: YAML takes it for a comment.
_BARE_COLOR = re.compile(r"[:,\[]\s+(#[0-9a-fA-F]{3}(?:[0-9a-fA-F]{3})?)\b")
_WORDS: Mapping[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}


def read_document(
    text: str, file: str | None = None, *, error: type[ClfractalError] = SceneError
) -> Document:
    """Parses one YAML document.

    Numbers, booleans and null follow YAML 1.2's core schema: `1e-3`, `0x10` and `0o10` are numbers, `yes` and `1:30`
    are words.

    Raises:
        error: not YAML, not one document, a duplicate key, a tag, a number that is not finite, an alias that
            contains itself, or more than MAX_BYTES of text, MAX_NODES values or MAX_DEPTH levels.
    """
    return Document(_Builder(file, error).build(text))


def read_value(text: str, file: str) -> Node:
    """A value written in an option: every place in it is `file` alone, without line and column.

    A text that begins with `#` is a word here, such as a colour, although it would be a comment in a file.

    Raises:
        SceneError: as for read_document.
    """
    if text.lstrip().startswith("#"):
        return node_from_plain(text.strip(), file)
    try:
        root = read_document(text, file).root
    except SceneError as error:
        raise SceneError(error.message, Where(file), details=error.details) from error
    return node_from_plain(root.plain(), file)


def write_document(value: Any, *, only_ascii: bool = False) -> str:
    """YAML text of plain data that `read_document` reads back as equal data (whole floats as int).

    Args:
        only_ascii: write other characters as escapes.
    """
    return str(
        yaml.dump(
            _short(value),
            Dumper=_Dumper,
            sort_keys=False,
            default_flow_style=None,
            allow_unicode=not only_ascii,
            width=100,
        )
    )


def _short(value: Any) -> Any:
    """Whole floats as int, since [0, -3, 0] reads better than [0.0, -3.0, 0.0]."""
    if isinstance(value, Mapping):
        return {key: _short(child) for key, child in value.items()}
    if isinstance(value, (list, tuple)):
        return [_short(child) for child in value]
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15 and str(value) != "-0.0":
        return int(value)
    return value


class _Dumper(yaml.SafeDumper):
    """Quotes the strings that this file's reader would not read as strings; writes no aliases."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _represent_text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    # Only double quotes keep every character: elsewhere YAML folds line breaks, of which it knows five.
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if text.isprintable() else '"')


_Dumper.add_representer(str, _represent_text)
for _pattern in (_INT, _OTHER_BASES, _FLOAT, _NON_FINITE):
    _Dumper.add_implicit_resolver(
        "tag:yaml.org,2002:float", re.compile(f"(?:{_pattern.pattern})$"), list("-+.0123456789")
    )


@dataclass(slots=True)
class _Open:
    """A list or mapping that is being read; `merged`: mappings whose keys it takes over."""

    node: Node
    anchor: str | None
    key: str | None = None
    merged: list[Node] = field(default_factory=list)
    merges: bool = False


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
        parts = (len(o.node.value) if isinstance(o.node.value, list) else o.key for o in self.stack)
        path = dotted([part for part in parts if part is not None])
        raise self.error(message, Where(self.file, line, column, path or None))

    def fail_at(self, message: str, event: Any) -> NoReturn:
        self.fail(message, *_start(event))

    def build(self, text: str) -> Node:
        try:
            if len(text.encode()) > MAX_BYTES:
                raise self.error(f"is too large: at most {MAX_BYTES:,} bytes", Where(self.file))
        except UnicodeEncodeError as error:
            raise self.error("is not UTF-8 text", Where(self.file)) from error
        documents = 0
        event: Any
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
            yield from yaml.parse(text, Loader=PARSER)
        except yaml.reader.ReaderError as error:
            line = text.encode().count(b"\n", 0, error.position) + 1
            raise self.error("holds a character that YAML does not allow", Where(self.file, line)) from error
        except yaml.MarkedYAMLError as error:
            mark: Any = error.problem_mark or error.context_mark
            place = Where(self.file, mark.line + 1, mark.column + 1) if mark is not None else Where(self.file)
            problem = error.problem or error.context or "cannot be read"
            if "nesting depth" in problem:  # libyaml's own limit, of 1000, when it looks ahead
                raise self.error(f"nested more than {MAX_DEPTH} levels deep", place) from error
            near = text.splitlines()[max(mark.line - 3, 0) : mark.line + 1] if mark is not None else []
            # The rest of the line is a comment then, the closing bracket included.
            bare = next(filter(None, map(_BARE_COLOR.search, near)), None)
            hint = f'; a colour needs quotes: "{bare.group(1)}"' if bare else ""
            raise self.error(f"not valid YAML: {problem}{hint}", place) from error
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
        line, column = _start(event)
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
        if event.value in top.node.keys:
            first = top.node.keys[event.value][0]
            self.fail_at(f"duplicate key {event.value[:60]!r}, first on line {first}", event)
        top.key = event.value
        top.merges = event.value == MERGE and event.implicit[0]
        top.node.keys[event.value] = _start(event)

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
        elif top.merges:
            top.merged = self._to_merge(node, *top.node.keys[MERGE])
            top.key, top.merges = None, False
        else:
            top.node.value[top.key] = node
            top.key = None
        top.node.size += node.size

    def _to_merge(self, node: Node, line: int, column: int) -> list[Node]:
        """The mappings that the value of `<<` names: one, or a list of them."""
        found = node.value if isinstance(node.value, list) else [node]
        if not all(isinstance(each.value, dict) for each in found):
            self.fail(
                "merges mappings: its value must be one, such as *name, or a list of them", line, column
            )
        return list(found)

    def _close(self, event: Any) -> None:
        open_ = self.stack.pop()
        if open_.merged:
            _merge(open_.node, open_.merged)
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
        other = _OTHER_BASES.fullmatch(text) is not None
        whole = other or _INT.fullmatch(text) is not None
        if not whole and not _FLOAT.fullmatch(text):
            return text
        if len(text) > MAX_NUMBER_LENGTH:
            self.fail_at(f"a number of more than {MAX_NUMBER_LENGTH} characters", event)
        number = (int(text, 0) if other else int(text)) if whole else float(text)
        if not math.isfinite(number):
            self.fail_at(f"must be a finite number, got {text}", event)
        return number


def _merge(node: Node, merged: list[Node]) -> None:
    """Puts the keys of other mappings before a mapping's own, which win; of several mappings the first one does."""
    own, places = node.value, node.keys
    node.value, node.keys = {}, {}
    for each in merged:
        for key, child in each.value.items():
            if key not in node.value:
                node.value[key] = child
                node.keys[key] = each.keys[key]
    node.value |= own
    node.keys |= places


def _start(event: Any) -> tuple[int, int]:
    return event.start_mark.line + 1, event.start_mark.column + 1


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
