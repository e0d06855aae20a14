"""The scenes in pictures: which format a file has, and the text in its header. Each format has its own module."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from clfractal.files.regular import read_bytes

_LONGEST = 12


def is_picture(path: Path) -> bool:
    """Whether a file begins as one of the formats does that may hold a scene.

    Raises:
        FileError: it cannot be read.
    """
    return _module(read_bytes(path, prefix=_LONGEST)) is not None


def read_scene_text(path: Path) -> str | None:
    """The scene in a picture's header; None if it has none.

    Raises:
        FileError: it is no picture, or cannot be read, or is damaged or cut short.
    """
    name = _module(read_bytes(path, prefix=_LONGEST)) or "png"
    # Imported only now: a scene file needs none of them.
    read: Callable[[Path], str | None] = import_module(f"clfractal.files.{name}").read_scene_text
    return read(path)


def _module(start: bytes) -> str | None:
    """The module for a file that begins so."""
    if start.startswith(b"\x76\x2f\x31\x01"):
        return "exr_header"
    if start.startswith(b"\x89PNG\r\n\x1a\n"):
        return "png"
    if start.startswith(b"\xff\xd8\xff") or (start[:4] == b"RIFF" and start[8:12] == b"WEBP"):
        return "photo"
    return None
