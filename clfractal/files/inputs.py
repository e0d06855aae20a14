"""Which files are read, and that no output replaces one of them or another output.

The functions that read users' files call `note`; whoever loads a scene asks with `noting` which files those were.
So a scene knows all its files, also those that its files name, and no command has to list them.
"""

from __future__ import annotations

import os
import tempfile
import unicodedata
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import TypeAlias

from clfractal.errors import FileError, Where

# A file that is there: its device and inode. One that is not: those of its folder, and its name as file systems may
# compare it that do not tell upper from lower case.
_Key: TypeAlias = tuple[int, int] | tuple[int, int, str] | str

_LISTS: ContextVar[tuple[list[Path], ...]] = ContextVar("lists of noted files", default=())


@contextmanager
def noting() -> Iterator[list[Path]]:
    """Gives a list to which every file is added that is read in this block, as an absolute path; each one once."""
    files: list[Path] = []
    token = _LISTS.set((*_LISTS.get(), files))
    try:
        yield files
    finally:
        _LISTS.reset(token)


def note(path: str | Path) -> None:
    """A user's file is read: to be called by the functions that open such files."""
    for files in _LISTS.get():
        found = Path(os.path.abspath(path))
        if found not in files:
            files.append(found)


def refuse_overwriting(outputs: Iterable[str | Path], inputs: Iterable[str | Path] = ()) -> None:
    """Makes sure, before anything is rendered, that no output is a file that is read, or another output.

    Files are compared by device and inode, links followed; outputs that are not there yet by their folder and name.

    Args:
        outputs: every file that will be written, also those whose names are derived, such as `out_L.png`; each once.
        inputs: every file that the work reads, such as `scene.files`.

    Raises:
        FileError: one of the outputs must not be written.
    """
    read = {_key(path): Path(path) for path in inputs}
    taken: dict[_Key, list[Path]] = {}
    for path in map(Path, outputs):
        key = _key(path)
        if key in read:
            same = "it" if _is_spelled(path, read[key]) else f"it is the file {_shown(read[key])!r}, which"
            raise FileError(
                f"would be overwritten, but {same} is read for this; name another output", Where(str(path))
            )
        others = taken.setdefault(key, [])
        for other in others:
            if not (isinstance(key, tuple) and len(key) == 3 and _differ(path, other)):
                same = "" if _is_spelled(path, other) else f", also as {_shown(other)!r}"
                raise FileError(
                    f"would be written twice{same}; each output needs a file of its own", Where(str(path))
                )
        others.append(path)


def _is_spelled(path: Path, other: Path) -> bool:
    return os.path.abspath(path) == os.path.abspath(other)


def _shown(path: Path) -> str:
    """A path as short as it can be told."""
    try:
        short = os.path.relpath(path)
    except ValueError:  # on another drive
        return str(path)
    return str(path) if short.startswith(os.pardir) else short


def _key(path: str | Path) -> _Key:
    """Equal for two paths that lead to one file."""
    with suppress(OSError, ValueError):
        real = os.path.realpath(path)
        with suppress(FileNotFoundError):
            found = os.stat(real)
            return (found.st_dev, found.st_ino) if found.st_ino else os.path.normcase(real)
        folder = os.stat(os.path.dirname(real))
        if folder.st_ino:
            return folder.st_dev, folder.st_ino, _folded(os.path.basename(real))
    return os.path.normcase(os.path.abspath(path))


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def _differ(path: Path, other: Path) -> bool:
    """Whether two names that are equal but for upper and lower case, or accents, are two files in their folder."""
    one, two = (os.path.basename(os.path.realpath(each)) for each in (path, other))
    if one == two:
        return False
    try:
        with tempfile.TemporaryDirectory(
            prefix=".names-", dir=os.path.dirname(os.path.realpath(path))
        ) as empty:
            Path(empty, one).touch()
            return not Path(empty, two).exists()
    except OSError:
        return False  # nothing can be written there either, which is told when it is tried
