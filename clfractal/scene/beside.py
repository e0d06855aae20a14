"""Reading files that a scene names: they are beside it, and errors stand at the key that names them.

Pictures that come with another program stay where that has them: `mandelbulber:NAME` is one of the Mandelbulber 2 that is
installed.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clfractal.device.activity import doing
from clfractal.errors import FileError, Where
from clfractal.exchange.program_folder import SHARED, pictures_folder
from clfractal.files.inputs import note
from clfractal.formulas.own import safe_path


def place_of(file: str, folder: Path, where: Where) -> Path:
    """The path of a file that a scene from `folder` names.

    Raises:
        FileError: at `where`: it is out of its folder, or that program is not installed.
    """
    if not file.startswith(SHARED):
        return safe_path(file, folder, where)
    shared = pictures_folder()
    if shared is None:
        raise FileError(f"is a picture of Mandelbulber 2, which is not installed: {file[:80]!r}", where)
    return safe_path(file.removeprefix(SHARED), shared, where)


@contextmanager
def reading_beside(file: str, folder: Path, where: Where) -> Iterator[Path]:
    """Gives the path of a file that a scene from `folder` names, to be read in this block.

    Raises:
        FileError: at `where`, for a file out of the folder, or whatever is wrong with it.
    """
    path = place_of(file, folder, where)
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
