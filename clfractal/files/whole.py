"""Whether picture files are whole: one whose writing or copying broke off is not."""

from __future__ import annotations

import os
from pathlib import Path

from clfractal.errors import FileError
from clfractal.files.atomic import file_error, open_regular

_IEND = b"\0\0\0\0IEND\xaeB`\x82"
_END_OF_JPEG = b"\xff\xd9"
_TAIL = 12


def is_whole(path: Path) -> bool:
    """Whether a file is there and ends as its format says; other kinds than pictures need only be there.

    Raises:
        FileError: it cannot be read.
    """
    if not path.exists():
        return False
    with open_regular(path) as stream:
        try:
            start = stream.read(_TAIL)
            size = os.fstat(stream.fileno()).st_size
            stream.seek(max(size - _TAIL, 0))
            tail = stream.read(_TAIL)
        except OSError as error:
            raise file_error(path, "cannot be read", error) from error
    if start.startswith(b"\x89PNG"):
        return tail == _IEND
    if start.startswith(b"\xff\xd8\xff"):
        return tail.endswith(_END_OF_JPEG)
    if start.startswith(b"RIFF"):
        # A chunk of an odd length is padded, and the length of the whole does not say so in all files.
        return size - 8 - int.from_bytes(start[4:8], "little") in (0, 1)
    if start.startswith(b"\x76\x2f\x31\x01"):
        return _is_whole_exr(path)
    return size > 0


def _is_whole_exr(path: Path) -> bool:
    from clfractal.files.exr_header import read_header

    try:
        read_header(path)
    except FileError:
        return False
    return True
