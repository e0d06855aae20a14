"""One flat OpenCL C text of an entry point, its headers and generated parts; each line's origin is kept.

Drivers disagree about include paths and cache by file name, so they are given a single text; `#line`
directives make their messages speak of the files that were written by hand.
"""

from __future__ import annotations

import os
import posixpath
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from clfractal.errors import KernelBuildError, Where, nearest
from clfractal.files.resources import folder

# (A search for a first letter is ten times as fast as one for the beginning of a line.)
_DIRECTIVE = re.compile(r'#[ \t]*(?:(?P<include>include)[ \t]*(?:"(?P<name>[^"\n]*)"|(?P<other>.*))|endif\b)')
_BETWEEN_NAMES = str.maketrans(
    {chr(code): " " for code in range(128) if not (chr(code).isalnum() or code == 95)}
)
_LINE = re.compile(r'^#line (?P<line>\d+) "(?P<name>[^"]*)"')


@dataclass(frozen=True, slots=True)
class SourceMap:
    """The texts a program was made of, by the names used in its `#line` directives."""

    texts: Mapping[str, str] = field(default_factory=dict)
    user: frozenset[str] = frozenset()
    """Names of texts generated from the user's formula: if they do not compile, the status is 2."""

    def excerpt(self, name: str, line: int, column: int | None = None) -> str:
        """The line (from 1) between its neighbours, numbered, with a caret under the column; or ''."""
        lines = self.texts.get(name, "").splitlines()
        if not 1 <= line <= len(lines):
            return ""
        shown: list[str] = []
        for number in range(max(1, line - 1), min(len(lines), line + 1) + 1):
            text = lines[number - 1].expandtabs(4)
            shown.append(f"{number:5d} | {text}")
            if number == line and column is not None and column >= 1:
                prefix = len(lines[number - 1][: column - 1].expandtabs(4))
                shown.append(" " * 5 + " | " + " " * prefix + "^")
        return "\n".join(shown)


def origin(text: str, line: int) -> tuple[str, int] | None:
    """File and line that `#line` directives give to a line (from 1) of a flat text.

    Oclgrind's messages count the lines of the whole text and call it `input.cl`.
    """
    for above, shown in enumerate(reversed(text.splitlines()[: line - 1])):
        directive = _LINE.match(shown)
        if directive is not None:
            return directive["name"], int(directive["line"]) + above
    return None


@dataclass(frozen=True, slots=True)
class FlatText:
    """The text for the driver and where its lines come from."""

    text: str
    sources: SourceMap


def flatten(
    entry: str,
    *,
    generated: Mapping[str, str] | None = None,
    defines: Mapping[str, object] | None = None,
    user: Collection[str] = (),
    kernels: Path | None = None,
) -> FlatText:
    """Put `entry` and all it includes into one text.

    Args:
        entry: a file of the kernels folder (`march.cl`) or the name of a generated text.
        generated: texts that may be included by their names (`formula.h`); they go before files of the same
            name.
        defines: names and values written as `#define` lines at the head of the text, of those that the text names.
        user: the generated texts that come from the user's formula.
        kernels: another folder than the one that travels with the program.

    Every text is taken in once, where it is first included: an include that depends on `#if` is the only one of its
    file. Quoted includes are looked for beside the including file, then in the kernels folder. Where they name a folder
    all its files are taken in, and a list of them is defined: see `kinds`.

    Raises:
        KernelBuildError: an include cannot be found or is not quoted, with its file and line.
    """
    parts = tuple((generated or {}).items()), tuple((defines or {}).items()), tuple(user)
    if kernels is not None:
        return _flatten(entry, *parts, kernels)
    return _flatten_kept(entry, *parts)


@lru_cache(maxsize=64)
def _flatten_kept(
    entry: str,
    generated: tuple[tuple[str, str], ...],
    defines: tuple[tuple[str, object], ...],
    user: tuple[str, ...],
) -> FlatText:
    """Of the kernels that travel with the program: one picture after the other asks for the same text."""
    return _flatten(entry, generated, defines, user, folder("kernels"))


def _flatten(
    entry: str,
    generated: tuple[tuple[str, str], ...],
    defines: tuple[tuple[str, object], ...],
    user: tuple[str, ...],
    kernels: Path,
) -> FlatText:
    flattener = _Flattener(kernels, dict(generated))
    flattener.add(entry, Where())
    text = "\n".join(flattener.lines) + "\n"
    # What a text never names makes no other program of it.
    named = frozenset().union(*(_read(*each).names for each in flattener.texts.items()))
    head = "".join(f"#define {name} {value}\n" for name, value in defines if name in named)
    return FlatText(head + text, SourceMap(flattener.texts, frozenset(user)))


class _Flattener:
    def __init__(self, kernels: Path, generated: dict[str, str]) -> None:
        self.kernels = kernels
        self.shipped = kernels == folder("kernels")
        self.generated = generated
        self.lines: list[str] = []
        self.texts: dict[str, str] = {}

    def add(self, name: str, where: Where, beside: str = "") -> None:
        shown, text = self._find(name, where, beside)
        if shown in self.texts:
            return
        self.texts[shown] = text
        self.lines.append(f'#line 1 "{shown}"')
        for piece in _read(shown, text).pieces:
            self.lines += piece.lines
            if piece.line:
                self._include(piece, Where(file=shown, line=piece.line), shown)
                self.lines.append(f'#line {piece.line + 1} "{shown}"')

    def _include(self, piece: _Piece, place: Where, beside: str) -> None:
        if piece.include is None:
            raise KernelBuildError(f'only #include "..." is possible, got {piece.other!r}', place)
        self.add(piece.include, place, beside)

    def _find(self, name: str, where: Where, beside: str) -> tuple[str, str]:
        if name in self.generated:
            return f"generated/{name}", self.generated[name]
        # (Files that travel with the program are read once.)
        found = (_found_once if self.shipped else _found)(self.kernels, name, beside)
        if found is not None:
            return found
        if family := (_family_once if self.shipped else _family)(self.kernels, name):
            return f"generated/{name}", family
        root = self.kernels.resolve()
        there = [path.relative_to(root).as_posix() for path in root.rglob("*.[ch]*")] + list(self.generated)
        guess = nearest(name, there)
        hint = f"; did you mean {guess!r}?" if guess else ""
        raise KernelBuildError(f"there is no kernel file {name!r}{hint}", where)


def _found(kernels: Path, name: str, beside: str) -> tuple[str, str] | None:
    """The name and the text of a file of the kernels' folder that is included beside another; None if there is none."""
    folders = [""]
    if beside.startswith("kernels/"):
        folders.insert(0, posixpath.dirname(beside.removeprefix("kernels/")))
    for path in (posixpath.normpath(posixpath.join(base, name)) for base in folders):
        if not path.startswith(("../", "/")) and os.path.isfile(file := f"{kernels}/{path}"):
            with open(file, encoding="utf-8") as stream:
                return f"kernels/{path}", stream.read()
    return None


_found_once = lru_cache(maxsize=None)(_found)


def kinds(family: str, kernels: Path | None = None) -> dict[str, int]:
    """The kinds that a folder of kernels has files of, such as `elements/shapes`, each with its number from 1.

    In C they are `SHAPE_BOX` and so on, and `SHAPES(DO)` is `DO(BOX, box) ...` of those whose files are there. A folder
    in such a folder has more of some kinds, or all that there is of them, under the same numbers.
    """
    names = {path.stem for path in ((kernels or folder("kernels")) / family).rglob("*.h")}
    return {name: number for number, name in enumerate(sorted(names), 1)}


def _family(kernels: Path, name: str) -> str:
    """The text that stands for a folder; "" if there is none."""
    several = name.rpartition("/")[2].upper()
    own = sorted(path.stem for path in (kernels / name).glob("*.h"))
    lines = [f'#include "{name}/{kind}.h"' for kind in own]
    if name.count("/") == 1:
        one = several.removesuffix("S")
        lines += [f"#define {one}_{kind.upper()} {number}" for kind, number in kinds(name, kernels).items()]
    entries = " ".join(f"DO({kind.upper()}, {kind})" for kind in own)
    return "\n".join([*lines, f"#define {several}(DO) {entries}"]) if lines else ""


_family_once = lru_cache(maxsize=None)(_family)


@dataclass(frozen=True, slots=True)
class _Piece:
    """Some lines each of a text, and the include behind them, which is on the line `line` (from 1; 0: there is none)."""

    lines: tuple[str, ...]
    line: int
    include: str | None = None
    other: str = ""


@dataclass(frozen=True, slots=True)
class _Text:
    """A text's pieces, and the words in it."""

    pieces: tuple[_Piece, ...]
    names: frozenset[str]


@lru_cache(maxsize=512)
def _read(shown: str, text: str) -> _Text:
    """A text that messages call `shown`: most are a part of many programs."""
    pieces: list[_Piece] = []
    lines: list[str] = []
    whole = "\n".join(text.splitlines())
    start, number, counted, included = 0, 1, 0, False
    # (Every start reads the kernels: they are cut where a directive says so, not looked through line by line.)
    for found in _DIRECTIVE.finditer(whole):
        begin, end = whole.rfind("\n", 0, found.start()) + 1, whole.find("\n", found.end())
        end = len(whole) if end < 0 else end
        if whole[begin : found.start()].strip(" \t"):
            continue
        number += whole.count("\n", counted, begin)
        counted = begin
        if found["include"]:
            included = True
            lines += [whole[start : begin - 1]] if begin > start else []
            pieces.append(_Piece(tuple(lines), number, found["name"], (found["other"] or "").strip()))
            lines = []
        elif included:
            # Where the condition was false, the compiler has not seen the directive behind the include.
            lines += [whole[start:end], f'#line {number + 1} "{shown}"']
            included = False
        else:
            continue
        start = end + 1
    if start < len(whole) or (start == len(whole) and whole.endswith("\n")):
        lines.append(whole[start:])
    return _Text((*pieces, _Piece(tuple(lines), 0)), frozenset(text.translate(_BETWEEN_NAMES).split()))
