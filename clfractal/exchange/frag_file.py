"""Reads a fragment of Fragmentarium or FragM: its words, presets, and what it includes.

Files that it includes are read only beside it. Those that render are never read: their names tell what they ask for.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from clfractal.errors import FileError, Where
from clfractal.exchange.glsl_functions import HELPERS
from clfractal.exchange.glsl_tokens import Macros, Token, words_of
from clfractal.files.regular import read_bytes
from clfractal.formulas.own import safe_path

MAX_BYTES = 1_000_000
MAX_LINES = 50_000
MAX_FILES = 16
MAX_PRESETS = 1_000
MAX_KEYS = 2_000
_DEPTH = 8

_RENDERERS = (
    "ray",
    "trac",
    "3d",
    "de-",
    "soft",
    "brute",
    "kn",
    "ibl",
    "render",
    "camera",
    "light",
    "sky",
    "post",
)
"""Parts of the names of files that render."""
_COMMENT = re.compile(r"//[^\n]*|/\*.*?(?:\*/|\Z)", re.DOTALL)
_NO_LINE = re.compile(r"[^\n]")
_SILENT = (
    *(
        "info",
        "group",
        "camera",
        "donotrun",
        "buffer",
        "buffershader",
        "texparameter",
        "version",
        "extension",
    ),
    *("pragma", "line", "endvertex", "shader", "synthclipboard", "subframes", "maxsubframes"),
)
"""Lines for the program that do not change what a fragment computes."""


@dataclass(frozen=True, slots=True)
class Setting:
    """The value of a preset's key, as text."""

    text: str
    where: Where


@dataclass
class Fragment:
    """What was read.

    Attributes:
        words: its code, with those of the files that it includes, and macros written in.
        presets: their settings by key, by name, in their order.
        includes: what it includes that was not read.
        info: what `#info` says first.
        files: the names of the files beside it that were read.
    """

    file: str
    words: list[Token] = field(default_factory=list)
    presets: dict[str, dict[str, Setting]] = field(default_factory=dict)
    includes: list[str] = field(default_factory=list)
    info: str = ""
    files: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


def read_fragment(path: Path) -> Fragment:
    """Reads a file, and what it includes from its folder.

    Raises:
        FileError: a file cannot be read, is too large, or has a word that is none of the language, with its place.
    """
    content = read_bytes(path, limit=MAX_BYTES)
    return parse_fragment(_text(content), str(path), path.parent)


def parse_fragment(text: str, file: str, folder: Path | None = None) -> Fragment:
    """As `read_fragment`, of a text; `folder`: where included files are; None: nowhere."""
    reader = _Reader(Fragment(file), folder)
    try:
        reader.read(text, file, 0)
    except RecursionError:
        raise FileError("macros stand for too much", Where(file)) from None
    reader.found.words = reader.words
    return reader.found


def _text(content: bytes) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")  # old files have comments of any kind


class _Reader:
    """Goes through the lines of files."""

    def __init__(self, found: Fragment, folder: Path | None) -> None:
        self.found, self.folder = found, folder
        self.macros = Macros()
        self.words: list[Token] = []

    def read(self, text: str, file: str, depth: int) -> None:
        if text.count("\n") >= MAX_LINES:
            raise FileError(f"has more than {MAX_LINES:,} lines", Where(file))
        lines = _without_comments(self._without_presets(text.replace("\r\n", "\n").replace("\r", "\n"), file))
        # Of each `#if` around a line whether its part counts, and whether one of its parts did.
        open_parts: list[tuple[bool, bool]] = []
        in_vertex = False
        code: list[str] = []
        begin = 1
        begun = ""
        for number, line in enumerate([*lines.split("\n"), "#"], 1):
            line, begun = begun + line, ""
            stripped = line.strip()
            if stripped.startswith("#") and stripped.endswith("\\") and len(line) < 20_000:
                begun = line.rstrip()[:-1] + " "
                code.append("")
                continue
            if not stripped.startswith("#"):
                counts = all(part for part, _ in open_parts) and not in_vertex
                code.append(line if counts else "")
                continue
            self._code(code, file, begin)
            code, begin = [], number + 1
            name, _, rest = stripped[1:].strip().partition(" ")
            name, rest = name.partition("\t")[0], (name.partition("\t")[2] + " " + rest).strip()
            where = Where(file, number, line.index("#") + 1 if "#" in line else 1)
            if name in ("if", "ifdef", "ifndef", "else", "elif", "endif"):
                self._condition(name, rest, open_parts, where)
            elif all(part for part, _ in open_parts):
                if name == "vertex":
                    in_vertex = True
                elif name == "endvertex":
                    in_vertex = False
                elif not in_vertex:
                    self._directive(name, rest, where, depth)
        if open_parts:
            raise FileError("#if has no #endif", Where(file))

    def _code(self, lines: Sequence[str], file: str, begin: int) -> None:
        words = words_of("\n".join(lines), file, begin)
        # Names mean what they did where they stand.
        self.words += self.macros.expanded([word for word in words if word.kind != "line"])
        if len(self.words) > 100_000:
            raise FileError("is too long: at most 100,000 words", Where(file))

    def _directive(self, name: str, rest: str, where: Where, depth: int) -> None:
        lower = name.lower()
        if lower == "define":
            self.macros.define(words_of(rest, str(where.file), where.line or 1))
        elif lower == "undef":
            self.macros.known.pop(rest.strip(), None)
        elif lower == "include":
            self._include(rest, where, depth)
        elif lower == "info" and not self.found.info and not depth:
            self.found.info = " ".join(rest.split())[:200]
        elif lower and lower not in _SILENT:
            self.found.remarks.append(f"line {where.line}: #{name[:40]} is not taken over")

    def _condition(self, name: str, rest: str, parts: list[tuple[bool, bool]], where: Where) -> None:
        if name in ("ifdef", "ifndef"):
            holds = (rest.split()[:1] or [""])[0] in self.macros.known
            holds = holds == (name == "ifdef")
            parts.append((holds, holds))
            if len(parts) > 64:
                raise FileError("#if are within each other too deep", where)
            return
        if name == "if":
            holds = self._holds(rest, where)
            parts.append((holds, holds))
            if len(parts) > 64:
                raise FileError("#if are within each other too deep", where)
            return
        if not parts:
            raise FileError(f"#{name} has no #if", where)
        _, done = parts.pop()
        if name == "else":
            parts.append((not done, True))
        elif name == "elif":
            holds = not done and self._holds(rest, where)
            parts.append((holds, done or holds))

    def _holds(self, text: str, where: Where) -> bool:
        """Whether what `#if` asks for is so: numbers, macros, `defined`, joined by `&&` and `||`."""
        for alternative in text.split("||"):
            if all(self._is_so(each.strip(), where) for each in alternative.split("&&")):
                return True
        return False

    def _is_so(self, text: str, where: Where) -> bool:
        opposite = text.startswith("!") and not text.startswith("!=")
        text = text.removeprefix("!").strip() if opposite else text
        if text.startswith("defined"):
            found = text.removeprefix("defined").strip(" ()\t") in self.macros.known
        else:
            words = list(
                self.macros.expanded(words_of(text.strip("() \t"), str(where.file), where.line or 1))
            )
            number = words[0].text if len(words) == 1 else ""
            if len(words) == 1 and words[0].kind == "name":
                number = "0"
            if not number.isdecimal():
                raise FileError(f"#if {text[:60]} is outside of what is read", where)
            found = int(number[:9]) != 0
        return found != opposite

    def _include(self, rest: str, where: Where, depth: int) -> None:
        name = rest.strip().strip('"<>').strip()
        if not name or len(name) > 200:
            raise FileError("#include must name a file", where)
        stem = name.replace("\\", "/").rpartition("/")[2].lower().removesuffix(".frag")
        if "2d" in stem and "3d" not in stem:
            raise FileError(f"{name} draws in the plane; what is read has a distance in space", where)
        if stem in HELPERS or any(part in stem for part in _RENDERERS):
            self.found.includes.append(stem)
            return
        simple = "/" not in name and "\\" not in name and not name.startswith(".")
        path = self.folder / name if simple and self.folder is not None else None
        if path is None or not path.is_file():
            self.found.includes.append(stem)
            self.found.remarks.append(
                f"line {where.line}: {name[:60]} is not beside the file; it was left out"
            )
            return
        if len(self.found.files) >= MAX_FILES or depth >= _DEPTH:
            raise FileError(f"includes more than {MAX_FILES} files", where)
        assert self.folder is not None
        safe_path(name, self.folder, where)
        self.found.files.append(name)
        self.read(_text(read_bytes(path, name=name, limit=MAX_BYTES)), name, depth + 1)

    def _without_presets(self, text: str, file: str) -> str:
        """The text without its presets, which are noted."""
        if "#preset" not in text:
            return text
        lines, current = [], None
        for number, line in enumerate(text.split("\n"), 1):
            stripped = line.strip()
            if stripped.startswith("#preset"):
                name = " ".join(stripped.removeprefix("#preset").split())[:80] or "Default"
                if len(self.found.presets) >= MAX_PRESETS:
                    raise FileError(f"has more than {MAX_PRESETS:,} presets", Where(file, number))
                current = self.found.presets.setdefault(name, {})
            elif stripped.startswith("#endpreset"):
                current = None
            elif current is None:
                lines.append(line)
                continue
            elif "=" in stripped and not stripped.startswith("//"):
                key, _, value = (part.strip() for part in stripped.partition("="))
                if len(current) >= MAX_KEYS:
                    raise FileError(f"a preset has more than {MAX_KEYS:,} keys", Where(file, number))
                column = line.index("=") + 2
                current[key[:80]] = Setting(value[:400], Where(file, number, column, key[:80]))
            lines.append("")
        return "\n".join(lines)


def _without_comments(text: str) -> str:
    """The text with comments as blanks, so that what is left keeps its place."""
    return _COMMENT.sub(lambda found: _NO_LINE.sub(" ", found[0]), text)
