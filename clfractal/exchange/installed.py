"""The formulas of the Mandelbulber 2 that the user has installed, or of a folder that the user names.

Nothing of them is a part of this program: their texts are read when a scene is imported.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from clfractal.errors import FileError, Where
from clfractal.exchange.c_text import MAX_CHARACTERS, Statement, read_formula, without_comments
from clfractal.exchange.numbers import NAMES
from clfractal.exchange.program_folder import program_folder
from clfractal.files.regular import read_bytes

_NOTHING = """
7 10 61 71 72 76 82 85 87 88 89 90 95 98 99 100 101 103 104 105 106 107 108 109 110 111 112 113 114 115 117 122 130
136 139 141 142 143 149 150 152 156 173 174 182 183 185
"""
ADD_NOTHING = frozenset(map(int, _NOTHING.split()))
"""Formulas after which nothing is added, unless the file says so. Transforms, from 1000 on, and shapes are such too."""
ADD_SWAPPED = frozenset((64, 73))
"""Formulas after which x and y of the point are added in each other's place."""
ADD_THEMSELVES = frozenset((19, 56, 63, 66, 67))
"""Formulas that add the point by themselves: what the file says of it changes nothing."""


class Installed:
    """The texts below a folder: its own, or `formula/opencl` in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def text(self, number: int) -> tuple[tuple[Statement, ...], Path] | None:
        """A formula's statements, and the file that they are from; None if there is none of that number.

        Raises:
            FileError: the file cannot be read, or is outside of the C that is read.
        """
        name = NAMES.get(number) or self._numbers.get(number)
        found = None if name is None else self._formulas / f"{name}.cl"
        if found is None or not found.is_file():
            return None
        return statements_of(found), found

    @property
    def files(self) -> Mapping[Path, int | None]:
        """All texts, and the number of each; None for one whose number is not known."""
        known = {name: number for number, name in {**self._numbers, **NAMES}.items()}
        return {path: known.get(path.stem) for path in sorted(self._formulas.glob("*.cl"))}

    @property
    def choices(self) -> Mapping[str, int]:
        """The names that choose between ways to do something, and their numbers."""
        return _enumerators(self.folder / "opencl" / "fractal_cl.h")

    @property
    def _formulas(self) -> Path:
        inner = self.folder / "formula" / "opencl"
        return inner if inner.is_dir() else self.folder

    @property
    def _numbers(self) -> Mapping[int, str]:
        return _by_pictures(self.folder / "formula" / "img", self._formulas)


def find_installed() -> Installed | None:
    """The program that is installed; None if there is none."""
    folder = program_folder()
    return None if folder is None else Installed(folder)


@cache
def statements_of(path: Path) -> tuple[Statement, ...]:
    """A text as statements.

    Raises:
        FileError: it cannot be read, or is outside of the C that is read.
    """
    content = read_bytes(path, limit=4 * MAX_CHARACTERS)
    return read_formula(content.decode("utf-8", "replace"), path.name)


@cache
def _by_pictures(folder: Path, formulas: Path) -> Mapping[int, str]:
    """The numbers of formulas, by the settings of the pictures that show them: of each, the formula that is its own."""
    from clfractal.exchange.settings import read_settings

    found: dict[int, str] = {}
    for path in sorted(folder.glob("*.fract"))[:1000]:
        if not (formulas / f"{path.stem}.cl").is_file():
            continue
        try:
            main = read_settings(path).main
            numbers = [main.whole(f"formula_{slot}", 0) for slot in (1, 2)]
        except FileError:
            continue
        is_transform = path.stem.startswith(("transf_", "testing"))
        own = next((each for each in numbers if (each >= 1000) == is_transform and each), None)
        if own is not None:
            found.setdefault(own, path.stem)
    return found


@cache
def _enumerators(path: Path) -> Mapping[str, int]:
    """What `enum` names in a header, numbered from 0 where it does not say otherwise."""
    if not path.is_file():
        return {}
    text = without_comments(read_bytes(path, limit=8_000_000).decode("utf-8", "replace"))
    found: dict[str, int] = {}
    for part in text.split("typedef enum")[1:]:
        inside = part.partition("{")[2].partition("}")[0]
        following = 0
        for entry in inside.split(","):
            name, value = (each.strip() for each in entry.partition("=")[::2])
            if not name:
                continue
            if value:
                if not value.lstrip("-").isdecimal():
                    raise FileError(f"enum {name[:40]}: must be a whole number", Where(str(path)))
                following = int(value)
            found[name] = following
            following += 1
    return found
