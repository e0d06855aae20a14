"""Reads settings files of Mandelbulber 2 (`.fract`), from anybody: sections, keys, values and their lines.

The format, as versions 2.00 to 2.34 write it: lines of comments (`#`), among them the version; sections (`[name]`);
in each section `key value;`. Keys that have their default are not there. The sections `keyframes` and `frames` are
tables of a film, `description` is text. Numbers have a point or a comma, by the country of who wrote the file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from clfractal.errors import FileError, Where
from clfractal.files.regular import read_bytes

FIRST = "# Mandelbulber settings file"
NEWEST = (2, 34)
"""The newest version whose keys are known."""
_TURNS_BY_CHOICE = (2, 7)
"""Kaleidoscopic sets of older files turn whether or not a key says so."""

MAX_BYTES = 8_000_000
MAX_LINES = 200_000
MAX_KEYS = 20_000
MAX_KEY = 200
MAX_VALUE = 100_000
MAX_NUMBER = 1e30

MAIN = "main_parameters"
SLOTS = 9
"""Formulas that a file may have."""
_TABLES = ("keyframes", "frames")
_TEXTS = ("description",)
_TRUE, _FALSE = ("1", "true"), ("0", "false")


@dataclass(frozen=True, slots=True)
class Entry:
    """A value as it is written, and its line, from 1."""

    text: str
    line: int


@dataclass
class Section:
    """The keys of a section. It remembers which were read, so that the others can be told.

    Every reading method gives `default` for a key that is not there, and raises FileError, at its line, for a value that
    is none of its kind.
    """

    file: str
    name: str
    entries: dict[str, Entry] = field(default_factory=dict)
    seen: set[str] = field(default_factory=set)

    def where(self, key: str) -> Where:
        """The place of a key, for errors."""
        entry = self.entries.get(key)
        return Where(self.file, entry.line if entry else None, path=key)

    def text(self, key: str, default: str = "") -> str:
        """The value as it is written."""
        self.seen.add(key)
        entry = self.entries.get(key)
        return default if entry is None else entry.text

    def numbers(self, key: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """As many numbers as the default has; missing ones at the end are its: old files have three of four."""
        words = self.text(key).split()
        if not words:
            return default
        if len(words) > len(default):
            wanted = "one number" if len(default) == 1 else f"{len(default)} numbers"
            raise FileError(f"must be {wanted}, got {len(words)}", self.where(key))
        return (*(self._number(key, word) for word in words), *default[len(words) :])

    def number(self, key: str, default: float) -> float:
        """One number."""
        return self.numbers(key, (default,))[0]

    def vector(self, key: str, default: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> tuple[float, ...]:
        """Three numbers; one is that of all, as old files have it."""
        if len(self.text(key).split()) == 1:
            default = (self.numbers(key, default)[0],) * 3
        return self.numbers(key, default)

    def whole(self, key: str, default: int) -> int:
        """A whole number."""
        found = self.number(key, default)
        if found != math.floor(found):
            raise FileError(f"must be a whole number, got {self.text(key)[:40]!r}", self.where(key))
        return int(found)

    def flag(self, key: str, default: bool) -> bool:
        """`true` or `false`, also as 1 or 0."""
        word = self.text(key).lower()
        if word not in ("", *_TRUE, *_FALSE):
            raise FileError(f"must be true or false, got {word[:40]!r}", self.where(key))
        return default if word == "" else word in _TRUE

    def color(self, key: str, default: tuple[int, int, int]) -> tuple[float, ...]:
        """Red, green and blue from 0 to 1, as a screen shows them; the file and the default have 16 bits of each."""
        words = self.text(key).split()
        codes: tuple[int, ...] = default
        if words:
            if len(words) != 3:
                raise FileError(f"must be three hexadecimal numbers, got {len(words)}", self.where(key))
            codes = tuple(self.code(key, word, 0xFFFF) for word in words)
        return tuple(code / 0xFFFF for code in codes)

    def code(self, key: str, word: str, most: int) -> int:
        """A hexadecimal number of a value."""
        digits = "0123456789abcdefABCDEF"
        found = int(word, 16) if word and len(word) <= 8 and all(each in digits for each in word) else -1
        if not 0 <= found <= most:
            raise FileError(f"must be hexadecimal, 0 to {most:x}, got {word[:40]!r}", self.where(key))
        return found

    def without(self, keys: Iterable[str]) -> None:
        """These keys have no meaning here, so they are not told."""
        self.seen.update(keys)

    def beginning(self, *starts: str) -> Iterator[str]:
        """The keys of the file that begin so."""
        return (key for key in self.entries if key.startswith(starts))

    def unread(self) -> Iterator[tuple[str, Entry]]:
        """What nobody asked for, in the order of the file."""
        return ((key, entry) for key, entry in self.entries.items() if key not in self.seen)

    def _number(self, key: str, word: str) -> float:
        try:
            found = float(word.replace(",", ".") if len(word) <= 60 and "_" not in word else "none")
        except ValueError:
            found = math.nan
        if not abs(found) <= MAX_NUMBER:
            raise FileError(f"must be a number, got {word[:40]!r}", self.where(key))
        return found


@dataclass
class Settings:
    """A file that was read: its sections by name, and what is remarkable about it."""

    file: str
    version: tuple[int, int] | None = None
    sections: dict[str, Section] = field(default_factory=dict)
    tables: list[tuple[str, int]] = field(default_factory=list)
    """The names and lines of tables of a film."""
    remarks: list[str] = field(default_factory=list)
    origins: list[str] = field(default_factory=list)
    """The texts that formulas were made of."""

    @property
    def main(self) -> Section:
        """The section that all but the formulas' own numbers is in."""
        return self.section(MAIN)

    def fractal(self, slot: int) -> Section:
        """The numbers of a formula; slots are counted from 1."""
        return self.section(f"fractal_{slot}")

    def section(self, name: str) -> Section:
        """A section; an empty one if it is not there."""
        return self.sections.setdefault(name, Section(self.file, name))


def read_settings(path: Path) -> Settings:
    """Reads a file.

    Raises:
        FileError: it cannot be read, is no regular file or too large, or what `parse_settings` refuses.
    """
    content = read_bytes(path, limit=MAX_BYTES)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")  # old files have names and descriptions of any kind
    return parse_settings(text, str(path))


def parse_settings(text: str, file: str) -> Settings:
    """The sections of a settings file's text.

    Raises:
        FileError: it is no settings file, a line that is none of the format, or more than the limits of this module.
    """
    found = Settings(file)
    lines = text.split("\n", MAX_LINES)
    if len(lines) > MAX_LINES:
        raise FileError(f"has more than {MAX_LINES:,} lines", Where(file))
    _check_first(lines[0].strip(), file)
    section: Section | None = None
    keys = 0
    for number, line in enumerate((each.strip() for each in lines), 1):
        if line.startswith("#"):
            _note_version(line, found)
        elif line.startswith("[") and line.endswith("]"):
            section = _opened(line[1:-1].strip(), number, found)
        elif section is None:
            if line:
                raise FileError("must stand in a section, such as [main_parameters]", Where(file, number))
        elif line and section.name not in (*_TABLES, *_TEXTS):
            keys += 1
            if keys > MAX_KEYS:
                raise FileError(f"has more than {MAX_KEYS:,} keys", Where(file, number))
            _note_entry(line, number, section, found)
    if found.version is None:
        found.remarks.append("the version is not told; read as one of 2.00 to 2.34")
    elif found.version < _TURNS_BY_CHOICE:
        for each in found.sections.values():
            if "IFS_rotation" in each.entries:
                each.entries["IFS_rotation_enabled"] = Entry("true", each.entries["IFS_rotation"].line)
    return found


def _check_first(line: str, file: str) -> None:
    if line.startswith("Mandelbulber "):
        raise FileError(
            "is of Mandelbulber 1; version 2 opens it and saves it in its own format", Where(file, 1)
        )
    if not line.startswith(FIRST):
        raise FileError(f"is no settings file of Mandelbulber 2, which begin with {FIRST!r}", Where(file, 1))


def _note_version(line: str, found: Settings) -> None:
    words = line[1:].split()
    if words[:1] != ["version"] or found.version is not None or len(words) != 2:
        return
    major, point, minor = words[1].partition(".")
    if point and major.isdecimal() and minor.isdecimal() and len(words[1]) < 12:
        found.version = (int(major), int(minor[:2].ljust(2, "0")))
        if found.version > NEWEST:
            found.remarks.append(f"is of version {words[1]}; keys that are newer than 2.34 are not known")


def _opened(name: str, number: int, found: Settings) -> Section:
    known = (MAIN, *_TEXTS, *_TABLES, *(f"fractal_{slot}" for slot in range(1, SLOTS + 1)))
    if name in _TABLES:
        found.tables.append((name, number))
    elif name not in known:
        found.remarks.append(f"line {number}: section [{name[:60]}] is not known")
    return found.section(name[:MAX_KEY])


def _note_entry(line: str, number: int, section: Section, found: Settings) -> None:
    where = Where(found.file, number)
    if not line.endswith(";"):
        raise FileError("must end with ';', as in `key value;`", where)
    key, _, value = line[:-1].strip().partition(" ")
    if not key or len(key) > MAX_KEY or not all(each.isalnum() or each == "_" for each in key):
        raise FileError(f"must be `key value;`, got {line[:60]!r}", where)
    if len(value) > MAX_VALUE:
        raise FileError(f"is too long: at most {MAX_VALUE:,} characters", where)
    if key in section.entries:
        found.remarks.append(f"line {number}: {key} is there twice; the last one counts")
    section.entries[key] = Entry(value.strip(), number)
