"""Names and keys of formula files: which are allowed."""

from __future__ import annotations

import keyword
import re
import zlib
from collections.abc import Collection, Mapping
from typing import Any

from clfractal.errors import FormulaError, Where, unknown_name
from clfractal.formulas.nodes import FUNCTIONS

# The number of the application, from 0; a formula that gives the name to something of its own has no such name.
APPLICATION = "n"

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
_RESERVED = frozenset({*FUNCTIONS, "log2", "pi", "dr", "added", "julia"})


def name_number(name: str) -> int:
    """The number by which kernels know a name: positive, of 31 bits.

    (A text in which two names had the same one would not compile.)
    """
    return zlib.crc32(name.encode()) % (2**31 - 1) + 1


def check_keys(data: Mapping[str, Any], known: Collection[str], where: Where) -> None:
    """Refuses keys that do not exist, with the nearest one that does."""
    for key in data:
        if key not in known:
            raise FormulaError(unknown_name("key", str(key), known), where)


def check_name(name: object, taken: Collection[object], where: Where) -> None:
    """Refuses a name that is malformed, reserved or taken."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        shown = str(name)[:60]
        raise FormulaError(
            f"a name is a letter followed by at most 39 letters, digits or '_', got {shown!r}", where
        )
    if name in _RESERVED or keyword.iskeyword(name) or name.startswith("point_"):
        raise FormulaError(f"the name {name!r} is reserved", where)
    if name in taken:
        raise FormulaError(f"the name {name!r} is used twice", where)


def as_mapping(data: object, where: Where, what: str) -> Mapping[str, Any]:
    """The data if it is a mapping; else an error."""
    if not isinstance(data, Mapping):
        raise FormulaError(f"{what} must be a mapping of keys to values", where)
    return data
