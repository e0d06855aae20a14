"""Reads files named by anybody: regular ones only, of bounded size, as UTF-8 text."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from clfractal.errors import FileError, Where
from clfractal.files import system
from clfractal.files.inputs import note

MAX_BYTES = 1_000_000


def check_regular(descriptor: int, name: str, limit: int | None) -> None:
    """Refuses what is no regular file (a device could be read for ever), and a file above `limit` bytes."""
    status = os.fstat(descriptor)
    if not stat.S_ISREG(status.st_mode):
        raise FileError("is not a regular file", Where(name))
    if limit is not None and status.st_size > limit:
        raise FileError(f"is too large: {status.st_size:,} bytes, at most {limit:,}", Where(name))


def read_bytes(
    path: Path, *, name: str | None = None, limit: int = MAX_BYTES, prefix: int | None = None
) -> bytes:
    """The bytes of a regular file, at most `limit`; or only the first `prefix` ones, of a file of any size.

    Raises:
        FileError: it cannot be read, is no regular file, or is too large.
    """
    shown = name or str(path)
    note(path)
    try:
        with open(path, "rb", opener=lambda name, _flags: os.open(name, system.READ)) as stream:
            check_regular(stream.fileno(), shown, None if prefix is not None else limit)
            content = stream.read(prefix if prefix is not None else limit + 1)
    except IsADirectoryError as error:
        raise FileError("is a folder, not a file", Where(shown)) from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        # `clfractal new pollen` writes pollen.yaml: its user may leave the ending away here, too.
        ended = isinstance(error, FileNotFoundError) and path.with_name(f"{path.name}.yaml").is_file()
        hint = f"; did you mean {shown}.yaml?" if ended else ""
        raise FileError(f"cannot be read: {reason}{hint}", Where(shown)) from error
    if prefix is None and len(content) > limit:
        raise FileError(f"is too large: at most {limit:,} bytes", Where(shown))
    return content


def decode(content: bytes, name: str) -> str:
    """UTF-8 text, or a FileError naming the line with the first byte that is none."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise FileError("is not UTF-8 text", Where(name, line)) from error


def read_text_file(path: Path, *, name: str | None = None, limit: int = MAX_BYTES) -> str:
    """The text of a regular file of at most `limit` bytes; FileError otherwise."""
    return decode(read_bytes(path, name=name, limit=limit), name or str(path))
