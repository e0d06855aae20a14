"""Reading files that a scene names: they are beside it, and errors stand at the key that names them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clfractal.device.activity import doing
from clfractal.errors import FileError, Where
from clfractal.files.inputs import note
from clfractal.formulas.own import safe_path


@contextmanager
def reading_beside(file: str, folder: Path, where: Where) -> Iterator[Path]:
    """Gives the path of a file that a scene from `folder` names, to be read in this block.

    Raises:
        FileError: at `where`, for a file out of the folder, or whatever is wrong with it.
    """
    path = safe_path(file, folder, where)
    try:
        with doing(f"reading {path}"):
            yield path
    except FileError as error:
        raise FileError(error.inside(str(path)), where, details=error.details) from error


def state_of(path: Path) -> tuple[int, int]:
    """What differs once a file has changed: scenes are loaded at every edit, and files read again only then."""
    note(path)
    try:
        status = path.stat()
    except (OSError, ValueError):
        return 0, 0
    return status.st_mtime_ns, status.st_size
