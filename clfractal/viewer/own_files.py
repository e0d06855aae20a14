"""Which files come with the program."""

from __future__ import annotations

import os
from pathlib import Path

from clfractal.files import resources

_OWN_FOLDERS = ("scenes", "environments", "formulas/library", "kernels")


def is_own(path: Path) -> bool:
    """Whether a file lies in one of the program's own folders, or is a link to such a file."""
    try:
        status = path.stat()
    except OSError:
        return False
    key = (status.st_dev, status.st_ino)
    parents = {
        (found.st_dev, found.st_ino) for parent in path.resolve().parents if (found := _status(parent))
    }
    for name in _OWN_FOLDERS:
        folder = resources.folder(name)
        inside = _status(folder)
        if inside is not None and (inside.st_dev, inside.st_ino) in parents:
            return True
        if any((found.st_dev, found.st_ino) == key for file in folder.iterdir() if (found := _status(file))):
            return True
    return False


def _status(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except OSError:
        return None
