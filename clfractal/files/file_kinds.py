"""What a file is, and so who reads it: by how it begins or, where that says nothing, how its name ends."""

from __future__ import annotations

from codecs import getincrementaldecoder
from contextlib import suppress
from pathlib import Path
from typing import Literal

from clfractal.files.regular import read_bytes

Kind = Literal["exr", "png", "photo", "volume", "settings", "fragment"]
OF_OTHERS: tuple[Kind, ...] = ("settings", "fragment")
"""Scenes of other programs, which are read and never written."""

_PICTURES: dict[Kind, tuple[str, ...]] = {
    "exr": (".exr",),
    "png": (".png",),
    "photo": (".jpg", ".jpeg", ".webp"),
}
_BY_ENDING: dict[str, Kind] = {
    **{ending: kind for kind, endings in _PICTURES.items() for ending in endings},
    **dict.fromkeys((".nrrd", ".nhdr", ".npy"), "volume"),
    ".fract": "settings",
    ".frag": "fragment",
}
_BEGINNINGS: dict[bytes, Kind] = {
    b"\x76\x2f\x31\x01": "exr",
    b"\x89PNG\r\n\x1a\n": "png",
    b"\xff\xd8\xff": "photo",
    b"NRRD000": "volume",
    b"\x93NUMPY": "volume",
    b"# Mandelbulber settings file": "settings",
}
_TEXTS = ("volume", "fragment")
"""Kinds whose files may be text that begins in any way."""
_LONGEST = max(map(len, _BEGINNINGS))


def kind_of(path: Path) -> Kind | None:
    """The kind of a file; None for all that is no picture that may hold a scene, no volume, nothing of another program.

    An empty or damaged file is of the kind that its name says: so whoever reads this kind tells what is wrong with it. But
    a scene may have any name, also that of a picture, if it is text; but for that of a fragment, which is text, too.

    Raises:
        FileError: it cannot be read.
    """
    start = read_bytes(path, prefix=_LONGEST)
    named = _BY_ENDING.get(path.suffix.lower())
    return kind_of_start(start) or (None if named not in _TEXTS and _is_text(start) else named)


def kind_of_start(start: bytes) -> Kind | None:
    """The kind of a file that begins with these bytes, twelve or more of them."""
    if start[:4] == b"RIFF" and start[8:12] == b"WEBP":
        return "photo"
    return next((kind for begin, kind in _BEGINNINGS.items() if start.startswith(begin)), None)


def _is_text(start: bytes) -> bool:
    """Whether a file that begins so may be text; an empty one is none."""
    printable = all(byte >= 32 or byte in b"\t\n\r" for byte in start)
    with suppress(UnicodeDecodeError):
        # The last letter may go on behind these bytes.
        return printable and bool(getincrementaldecoder("utf-8")().decode(start))
    return False
