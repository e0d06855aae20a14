"""The scenes in pictures: the text in the header of any format that may hold one."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from clfractal.files.file_kinds import Kind, kind_of

_MODULES: dict[Kind, str] = {"exr": "exr_header", "png": "png", "photo": "photo"}


def is_picture(path: Path) -> bool:
    """Whether a file is of a format that may hold a scene.

    Raises:
        FileError: it cannot be read.
    """
    return kind_of(path) in _MODULES


def read_scene_text(path: Path) -> str | None:
    """The scene in a picture's header; None if it has none.

    Raises:
        FileError: it is no picture, or cannot be read, or is damaged or cut short.
    """
    name = _MODULES.get(kind_of(path) or "png", "png")
    # Imported only now: a scene file needs none of them.
    read: Callable[[Path], str | None] = import_module(f"clfractal.files.{name}").read_scene_text
    return read(path)
