"""What Linux, macOS and Windows do differently with files, so that nothing else asks for the system.

Windows translates line ends in descriptors that are not binary, hands descriptors to child processes unless told not to,
and replaces or removes no file that is open.
"""

from __future__ import annotations

import errno
import os
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

_PLAIN = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NOINHERIT", 0) | getattr(os, "O_BINARY", 0)
READ = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | _PLAIN
"""For `os.open`: reading. (Without O_NONBLOCK, opening a pipe would wait for its other end.)"""
READ_AND_WRITE = os.O_RDWR | getattr(os, "O_NONBLOCK", 0) | _PLAIN
"""For `os.open`: a file that is there."""
CREATE = os.O_RDWR | os.O_CREAT | os.O_EXCL | _PLAIN
"""For `os.open`: a file that is not there yet."""

RENAMES_OPEN_FILES = os.name != "nt"
"""Whether a file that is open can be renamed and removed."""

# A virus scanner or an indexer holds a new file open for a moment, and Windows then replaces nothing.
_PATIENCE_S, _PAUSE_S = 1.0, 0.02
_LOCKED_BYTE = 1 << 42


class HeldError(Exception):
    """Another process holds the lock."""


def file_size_limit() -> int | None:
    """The most bytes that this process may write into one file (`ulimit -f`); None: as many as there is room for."""
    if sys.platform == "win32":
        return None
    try:
        import resource
    except ImportError:  # a Python without it
        return None
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    return None if limit == resource.RLIM_INFINITY else limit


def lock(descriptor: int, *, wait: bool = False) -> None:
    """Locks an open file against other processes until it is closed.

    Raises:
        HeldError: it is held elsewhere, and `wait` is False.
        OSError: the file system has no locks.
    """
    while not _locked_now(descriptor, wait):
        if not wait:
            raise HeldError
        time.sleep(_PAUSE_S)


if sys.platform == "win32":
    import msvcrt

    def _locked_now(descriptor: int, wait: bool) -> bool:
        # What is locked there nobody else can read: so it is a byte far behind every file's end.
        place = os.lseek(descriptor, 0, os.SEEK_CUR)
        os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError as error:
            if error.errno in (errno.EACCES, errno.EDEADLK, errno.EAGAIN):
                return False
            raise
        finally:
            os.lseek(descriptor, place, os.SEEK_SET)
        return True

else:
    import fcntl

    def _locked_now(descriptor: int, wait: bool) -> bool:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True


def read_at(descriptor: int, size: int, offset: int) -> bytes:
    """Up to `size` bytes from `offset` on; the descriptor's place may change."""
    if hasattr(os, "pread"):
        return bytes(os.pread(descriptor, size, offset))
    os.lseek(descriptor, offset, os.SEEK_SET)
    pieces = []
    while size > 0 and (piece := os.read(descriptor, size)):
        pieces.append(piece)
        size -= len(piece)
    return b"".join(pieces)


def write_at(descriptor: int, parts: Sequence[bytes | memoryview], offset: int) -> None:
    """Writes all bytes at `offset`, of which the system may take a piece at a time; the descriptor's place may change."""
    waiting = [memoryview(part) for part in parts]
    while waiting:
        if hasattr(os, "pwritev"):
            written = os.pwritev(descriptor, waiting, offset)
        else:
            os.lseek(descriptor, offset, os.SEEK_SET)
            written = os.write(descriptor, waiting[0])
        offset += written
        while waiting and written >= len(waiting[0]):
            written -= len(waiting.pop(0))
        if waiting:
            waiting[0] = waiting[0][written:]


def flush(descriptor: int) -> None:
    """Brings what was written to the disk; where that can be told apart, without the file's times."""
    if hasattr(os, "fdatasync"):
        os.fdatasync(descriptor)
    else:
        os.fsync(descriptor)


def set_mode(descriptor: int, path: Path, mode: int) -> None:
    """Gives an open file the permissions `mode`."""
    if hasattr(os, "fchmod"):
        os.fchmod(descriptor, mode)
    else:
        os.chmod(path, mode)


def replace(beside: Path, target: Path) -> None:
    """Renames a closed file to one that may be there already.

    Raises:
        OSError: it cannot be renamed; on Windows after a second, in which whoever has one of them open may close it.
    """
    end = time.monotonic() + _PATIENCE_S
    while True:
        try:
            os.replace(beside, target)
            return
        except PermissionError:
            if RENAMES_OPEN_FILES or time.monotonic() > end:
                raise
        time.sleep(_PAUSE_S)


def flush_folder(folder: Path) -> None:
    """Flushes a rename to the disk; on file systems that cannot do this for folders, it does nothing."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
