"""Plain data as pieces of YAML text, which `read_document` reads back as equal data."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

WIDTH = 110
"""Collections that would make a line longer than this are written on several lines."""

_PLAIN = re.compile(r"[A-Za-z_](?:[A-Za-z0-9_./*+()^-]| (?=[A-Za-z0-9_./*+(^-]))*")
# Words that readers of YAML 1.1 or 1.2 take for something else than text.
_RESERVED = frozenset(("null", "true", "false", "yes", "no", "on", "off"))


def same(a: Any, b: Any) -> bool:
    """Whether two plain values are equal; 4 and 4.0 are, true and 1 are not, and neither are 0 and -0.0."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if _is_list(a) and _is_list(b):
        return len(a) == len(b) and all(map(same, a, b))
    if _is_number(a) and _is_number(b):
        return bool(a == b) and math.copysign(1, a) == math.copysign(1, b)
    return type(a) is type(b) and bool(a == b)


def number_text(value: float, like: str = "") -> str:
    """The shortest text that reads back as the same number; `4` for 4.0, unless the text `like` has a point."""
    if isinstance(value, int):
        return str(value)
    if value.is_integer() and abs(value) < 1e15 and repr(value) != "-0.0":
        return repr(value) if "." in like else str(int(value))
    text = repr(value)
    # Readers of YAML 1.1 take `1e-05` for a word: they want a point before the exponent.
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def flow_text(value: Any, *, json_only: bool = False) -> str:
    """A value on one line; with `json_only` as JSON has it."""
    if isinstance(value, Mapping):
        inner = (
            f"{text_scalar(key, json_only=json_only)}: {flow_text(child, json_only=json_only)}"
            for key, child in value.items()
        )
        return "{" + ", ".join(inner) + "}"
    if _is_list(value):
        return "[" + ", ".join(flow_text(child, json_only=json_only) for child in value) + "]"
    if isinstance(value, str):
        return text_scalar(value, json_only=json_only)
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    return number_text(value)


def text_scalar(text: str, *, json_only: bool = False, quote: str = "") -> str:
    """A string, in quotes where it needs them or where `quote` asks for them."""
    if json_only:
        return '"' + "".join(map(_escaped_in_json, text)) + '"'
    if not quote and _PLAIN.fullmatch(text) and text.lower() not in _RESERVED:
        return text
    if quote == "'" and text.isprintable():
        return "'" + text.replace("'", "''") + "'"
    return '"' + "".join(map(_escaped, text)) + '"'


def _escaped(character: str) -> str:
    if character in '"\\':
        return "\\" + character
    if character.isprintable():
        return character
    if character == "\n":
        return "\\n"
    code = ord(character)
    return f"\\x{code:02x}" if code < 256 else f"\\u{code:04x}" if code < 65536 else f"\\U{code:08x}"


def _escaped_in_json(character: str) -> str:
    # JSON writes characters above 0xffff as two escapes, which YAML does not join: they stay as they are.
    if character.isprintable() or ord(character) > 0xFFFF:
        return _escaped(character) if character in '"\\' else character
    return f"\\u{ord(character):04x}"


def fits(value: Any, column: int) -> bool:
    """Whether a value is written on one line, where it begins at a column (from 0)."""
    if not isinstance(value, Mapping) and not (_is_list(value) and not all(map(_is_number, value))):
        return True
    return not value or column + len(flow_text(value)) <= WIDTH


def block_lines(value: Any, indent: int) -> list[str]:
    """The lines of a mapping or list that is not empty, each indented by `indent` spaces or more."""
    space = " " * indent
    lines = []
    if isinstance(value, Mapping):
        for key, child in value.items():
            name = f"{space}{text_scalar(key)}:"
            if fits(child, len(name) + 1):
                lines.append(f"{name} {flow_text(child)}")
            else:
                lines += [name, *block_lines(child, indent + 2)]
        return lines
    for child in value:
        if fits(child, indent + 2):
            lines.append(f"{space}- {flow_text(child)}")
        else:
            first, *rest = block_lines(child, indent + 2)
            lines += [f"{space}- {first[indent + 2 :]}", *rest]
    return lines


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
