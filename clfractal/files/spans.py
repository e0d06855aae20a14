"""A YAML text as a tree of values that know their part of the text, so that edits leave the rest alone."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import yaml

from clfractal.files.document import PARSER

_BLANK = re.compile(r"(?:[ \t\r\n]|(?<![^ \t\r\n])#[^\r\n]*)*")
_PROPERTIES = re.compile(r"(?:[&!][^\s,\[\]{}]*\s+)*")


class UnusualError(Exception):
    """The text is written in a way that is not edited in place."""


@dataclass(slots=True)
class Scalar:
    """A number, a word or a text; `style` is its quote, `|`, `>`, or empty.

    `end` of every node is the offset after its last character, comments behind it not counted.
    """

    start: int
    end: int
    value: str
    style: str
    anchor: str | None = None


@dataclass(slots=True)
class Alias:
    """A `*name`."""

    start: int
    end: int
    name: str


@dataclass(slots=True)
class Sequence:
    """A list: in brackets (`flow`), or with dashes, whose offsets are `dashes`."""

    start: int
    end: int
    flow: bool
    anchor: str | None
    entries: list[Node] = field(default_factory=list)
    dashes: list[int] = field(default_factory=list)


@dataclass(slots=True)
class Mapping:
    """Keys and values: in braces (`flow`), or one to a line; `colons` are the offsets of the colons (-1: none)."""

    start: int
    end: int
    flow: bool
    anchor: str | None
    keys: list[Scalar] = field(default_factory=list)
    values: list[Node] = field(default_factory=list)
    colons: list[int] = field(default_factory=list)


Node: TypeAlias = Scalar | Alias | Sequence | Mapping


def skip_blank(text: str, position: int) -> int:
    """The offset of the first character at or after a position that is neither white nor of a comment."""
    found = _BLANK.match(text, position)
    assert found is not None
    return found.end()


def parse(text: str) -> Mapping:
    """The tree of a text whose root is a mapping; the text has been read by `read_document` before.

    Raises:
        UnusualError: the parser refuses the text, or it has keys or empty values that are written in a rare way.
    """
    try:
        parsed = yaml.parse(text, Loader=PARSER)
        events = [event for event in parsed if isinstance(event, (yaml.NodeEvent, yaml.CollectionEndEvent))]
    except (yaml.YAMLError, ValueError) as error:
        raise UnusualError(str(error)) from error
    root, _ = _node(text, events, 0)
    if not isinstance(root, Mapping):
        raise UnusualError("the root is no mapping")
    return root


def value_start(text: str, node: Node) -> int:
    """Where a node's value begins, behind its anchor."""
    return (
        node.start if isinstance(node, Alias) or node.anchor is None else _after_properties(text, node.start)
    )


def _node(text: str, events: list[Any], at: int) -> tuple[Node, int]:
    """The node that begins with an event, and the index of the event after it."""
    event = events[at]
    match type(event):
        case yaml.AliasEvent:
            return Alias(event.start_mark.index, event.end_mark.index, event.anchor), at + 1
        case yaml.ScalarEvent:
            return _scalar(text, event), at + 1
        case yaml.SequenceStartEvent:
            return _sequence(text, events, at)
        case _:
            return _mapping(text, events, at)


def _scalar(text: str, event: Any) -> Scalar:
    start, end = event.start_mark.index, event.end_mark.index
    style = event.style or ""
    if style in ("|", ">"):
        # Its last line break belongs to the line, as for every other value.
        while end > start and text[end - 1] in "\r\n":
            end -= 1
    return Scalar(start, end, event.value, style, event.anchor)


def _sequence(text: str, events: list[Any], at: int) -> tuple[Sequence, int]:
    event = events[at]
    found = Sequence(event.start_mark.index, event.end_mark.index, bool(event.flow_style), event.anchor)
    place = _after_properties(text, found.start)
    at += 1
    while not isinstance(events[at], yaml.CollectionEndEvent):
        node, at = _node(text, events, at)
        if isinstance(node, Scalar) and node.start == node.end:
            raise UnusualError("an empty entry")
        if not found.flow:
            dash = skip_blank(text, place)
            if text[dash] != "-":
                raise UnusualError("a dash is missing")
            found.dashes.append(dash)
            place = node.end
        found.entries.append(node)
    found.end = events[at].end_mark.index if found.flow else found.entries[-1].end
    return found, at + 1


def _mapping(text: str, events: list[Any], at: int) -> tuple[Mapping, int]:
    event = events[at]
    found = Mapping(event.start_mark.index, event.end_mark.index, bool(event.flow_style), event.anchor)
    if found.flow and text[_after_properties(text, found.start)] != "{":
        raise UnusualError("a pair without braces")
    at += 1
    while not isinstance(events[at], yaml.CollectionEndEvent):
        key, at = _node(text, events, at)
        if not isinstance(key, Scalar) or key.start == key.end or text[: key.start].rstrip(" ").endswith("?"):
            raise UnusualError("an unusual key")
        value, at = _node(text, events, at)
        colon = skip_blank(text, key.end)
        if colon >= len(text) or text[colon] != ":":
            colon = -1
        if isinstance(value, Scalar) and value.start == value.end:
            # The parser places an empty value at the word after it.
            value.start = value.end = key.end if colon < 0 else colon + 1
        found.keys.append(key)
        found.values.append(value)
        found.colons.append(colon)
    found.end = events[at].end_mark.index if found.flow else found.values[-1].end
    return found, at + 1


def _after_properties(text: str, start: int) -> int:
    found = _PROPERTIES.match(text, start)
    assert found is not None
    return found.end()
