"""Which files come with the program."""

from __future__ import annotations

from pathlib import Path

from clfractal.files import resources

_OWN_FOLDERS = ("scenes", "environments", "formulas/library", "kernels")


def is_own(path: Path) -> bool:
    """Whether a file lies in one of the program's own folders, or is a link to such a file."""
    own = _identity(path)
    if own is None:
        return False
    parents = {_identity(parent) for parent in path.resolve().parents} - {None}
    folders = [resources.folder(name) for name in _OWN_FOLDERS]
    return any(_identity(folder) in parents or own in map(_identity, folder.iterdir()) for folder in folders)


def _identity(path: Path) -> tuple[int, int] | None:
    """What tells a file from all others, whatever it is called; None if there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino
