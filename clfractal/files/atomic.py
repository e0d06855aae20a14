"""Files appear complete or not at all: written beside their place, brought to the disk, then renamed.

Also the one place where opening and writing files turns the system's errors into one clear line.
"""

from __future__ import annotations

import errno
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from clfractal.errors import FileError, Where
from clfractal.files import system
from clfractal.files.inputs import note

PICTURES = (".exr", ".png", ".jpg", ".jpeg", ".webp")
"""Extensions of the picture formats that can be written, in lower case."""


def file_error(path: str | Path, what: str, error: Exception | str) -> FileError:
    """One line such as `out.exr: cannot be written: No space left on device`."""
    reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    if isinstance(error, OSError) and error.errno == errno.EFBIG:
        limit = system.file_size_limit()
        reason += f": at most {limit} bytes are allowed here (ulimit -f)" if limit is not None else ""
    return FileError(f"{what}: {reason}" if reason else what, Where(str(path)))


@contextmanager
def naming(path: str | Path, what: str) -> Iterator[None]:
    """The system's errors in this block become one line about a file, see `file_error`."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise file_error(path, what, error) from error


def _target(path: str | Path) -> Path:
    """The file that a name refers to: a symbolic link is kept, and the file it points to is replaced."""
    return Path(os.path.realpath(path))


def open_beside(target: Path) -> tuple[int, Path]:
    """A new hidden file in the folder of `target`, with the permissions that a plain new file would have."""
    # A name may already have the greatest length that the file system allows, so only its beginning is used.
    beside = target.with_name(f".{target.stem[:40]}.{secrets.token_hex(6)}.tmp")
    return os.open(beside, system.CREATE, 0o666), beside


def check_output(path: str | Path, extensions: tuple[str, ...] = PICTURES) -> None:
    """Makes sure, before anything expensive begins, that a file can be written.

    Raises:
        FileError: unknown extension; its folder is missing, no folder, or not writable; it is a folder, a
            device or write-protected.
    """
    shown = Path(path)
    suffix = shown.suffix.lower()
    if suffix not in extensions:
        known = ", ".join(extensions)
        raise file_error(
            path,
            f"unknown extension {suffix!r}; known: {known}" if suffix else f"needs an extension: {known}",
            "",
        )
    with naming(path, "cannot be written"):
        target = _target(path)
        if target.is_symlink():
            raise file_error(path, "cannot be written: it is a link that leads to itself", "")
        # Of a link, the folder of the file that it leads to.
        folder = str(target.parent if shown.is_symlink() else shown.parent)
        if not target.parent.exists():
            raise file_error(path, f"cannot be written: there is no folder {folder!r}", "")
        if not target.parent.is_dir():
            raise file_error(path, f"cannot be written: {folder!r} is not a folder", "")
        if target.is_dir():
            raise file_error(path, "cannot be written: it is a folder", "")
        if target.exists():
            if not target.is_file():
                raise file_error(path, "cannot be written: it is not a regular file", "")
            if not os.access(target, os.W_OK):
                raise file_error(path, "cannot be written: it is write-protected", "")
        # Access rights, read-only file systems, quotas: only an attempt to write tests all of them.
        descriptor, beside = open_beside(target)
        os.close(descriptor)
        beside.unlink()


@contextmanager
def atomic_writer(path: str | Path) -> Iterator[Path]:
    """Yields the path of an empty hidden file beside `path`, and renames it to `path` on success.

    On any exception (also an interrupt) the hidden file is removed and an earlier file stays untouched.

    Raises:
        FileError: any OSError inside the block, while bringing the file to the disk, or while renaming.
    """
    with naming(path, "cannot be written"):
        target = _target(path)
        descriptor, beside = open_beside(target)
    try:
        yield beside
        os.fsync(descriptor)
        with suppress(FileNotFoundError):
            system.set_mode(descriptor, beside, stat.S_IMODE(target.stat().st_mode))
        os.close(descriptor)
        descriptor = -1
        system.replace(beside, target)
        system.flush_folder(target.parent)
    except OSError as error:
        raise file_error(path, "cannot be written", error) from error
    finally:
        if descriptor >= 0:
            os.close(descriptor)
        with suppress(OSError):
            beside.unlink(missing_ok=True)


class ContentError(Exception):
    """What is wrong with a file's content; `reading` adds its name."""


@contextmanager
def reading(path: str | Path) -> Iterator[BinaryIO]:
    """A regular file that is open for reading, and whose name belongs to whatever goes wrong inside.

    Raises:
        FileError: it cannot be read, a ContentError inside, or its content does not fit into memory.
    """
    with open_regular(path) as stream:
        try:
            yield stream
        except OSError as error:
            raise file_error(path, "cannot be read", error) from error
        except MemoryError as error:
            raise file_error(path, "is too large: out of memory", "") from error
        except ContentError as error:
            raise file_error(path, str(error), "") from error.__cause__


def open_regular(path: str | Path) -> BinaryIO:
    """Opens a regular file for reading; it does not wait for a pipe or read a device.

    Raises:
        FileError: there is none, or it cannot be read.
    """
    note(path)
    with naming(path, "cannot be read"):
        descriptor = os.open(path, system.READ)
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISREG(mode):
            return os.fdopen(descriptor, "rb")
        os.close(descriptor)
    raise file_error(path, "is a folder, not a file" if stat.S_ISDIR(mode) else "is not a regular file", "")
