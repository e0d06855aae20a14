"""How the files of a film's frames are named: numbered pictures, and what is kept until a film is whole."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path

from clfractal.files.film_kinds import CONTAINERS

PARTIAL = ".partial"
"""What the name of an output gets for the file, or of a film for the folder, with unfinished work."""


def is_film(path: Path) -> bool:
    """Whether a file is a film, by its name."""
    return path.suffix.lower() in CONTAINERS


def split_pattern(name: str) -> tuple[str, str, str]:
    """What comes before the last row of `#` in a name, the row, and what comes after it."""
    found = re.fullmatch(r"(.*?)(#+)([^#]*)", name, re.DOTALL)
    assert found is not None
    return found[1], found[2], found[3]


def frame_file(pattern: Path, number: int) -> Path:
    """The file of a frame: its number stands for the last row of `#` in the pattern's name, with as many digits or more."""
    return Path(namer(pattern)(number))


def namer(pattern: Path) -> Callable[[int], str]:
    """Tells the file of each frame as text: of tens of thousands, paths take long to build."""
    name, signs, tail = split_pattern(pattern.name)
    head, digits = os.path.join(pattern.parent, name), len(signs)
    return lambda number: f"{head}{number:0{digits}d}{tail}"


def kept_folder(film: Path) -> Path:
    """The folder with a film's frames, until the film is whole."""
    return film.with_name(film.name + PARTIAL)


def kept_patterns(film: Path) -> tuple[Path, Path]:
    """The frames of films, kept beside the first of these: those with most bits, and those of 8 bits beside them."""
    folder = kept_folder(film)
    return folder / "######.png", folder / "######.8.png"


def frames_there(patterns: Sequence[Path], numbers: range) -> set[int]:
    """Which of the numbered frames have all their files, by their names; the patterns are of one folder.

    The folder is read once, and no name is built: it may hold tens of thousands.
    """
    try:
        names = os.listdir(patterns[0].parent)
    except OSError:
        return set()
    found = set(numbers)
    for pattern in patterns:
        head, signs, tail = split_pattern(pattern.name)
        least = len(signs)
        # More digits than signs only where the number needs them.
        digits = rf"\d{{{least}}}|[1-9]\d{{{least},}}"
        name = re.compile(f"{re.escape(head)}({digits}){re.escape(tail)}", re.ASCII)
        found &= {int(match[1]) for match in map(name.fullmatch, names) if match}
    return found
