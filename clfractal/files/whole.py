"""Whether picture files are whole: one whose writing or copying broke off is not."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from clfractal.errors import FileError
from clfractal.files.atomic import reading

_IEND = b"\0\0\0\0IEND\xaeB`\x82"
_END_OF_JPEG = b"\xff\xd9"
_TAIL = 12
# How files begin, by their names' ends.
_SIGNATURES: Mapping[str, bytes] = {
    ".png": b"\x89PNG",
    ".jpg": b"\xff\xd8\xff",
    ".jpeg": b"\xff\xd8\xff",
    ".webp": b"RIFF",
    ".exr": b"\x76\x2f\x31\x01",
}


def is_whole(path: Path) -> bool:
    """Whether a file is there, and begins and ends as its format says; other kinds than pictures need only be there.

    Its name says which format that is: random bytes are no picture.

    Raises:
        FileError: it cannot be read.
    """
    if not path.exists():
        return False
    with reading(path) as stream:
        start = stream.read(_TAIL)
        size = os.fstat(stream.fileno()).st_size
        stream.seek(max(size - _TAIL, 0))
        tail = stream.read(_TAIL)
    kind = path.suffix.lower()
    if kind not in _SIGNATURES:
        return size > 0
    if not start.startswith(_SIGNATURES[kind]):
        return False
    match kind:
        case ".png":
            return tail == _IEND
        case ".jpg" | ".jpeg":
            return tail.endswith(_END_OF_JPEG)
        case ".webp":
            # A chunk of an odd length is padded, and the length of the whole does not say so in all files.
            return size - 8 - int.from_bytes(start[4:8], "little") in (0, 1)
    return _is_whole_exr(path)


def is_foreign(path: Path) -> bool:
    """Whether a file is there that was never such a picture, cut short or not, as its name says: notes, or random bytes.

    Zeros, which a power failure leaves in the place of a file, are nobody's.

    Raises:
        FileError: it cannot be read.
    """
    signature = _SIGNATURES.get(path.suffix.lower(), b"")
    if not path.exists():
        return False
    with reading(path) as stream:
        start = stream.read(len(signature))
    return bool(start.strip(b"\0")) and not signature.startswith(start)


def _is_whole_exr(path: Path) -> bool:
    from clfractal.files.exr_header import read_header

    try:
        read_header(path)
    except FileError:
        return False
    return True
