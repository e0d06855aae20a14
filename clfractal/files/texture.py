"""Reads pictures that surfaces show."""

from __future__ import annotations

from pathlib import Path

from clfractal.files.atomic import ContentError
from clfractal.files.picture import Picture, read_picture

MAX_SIDE = 4096
BRIGHTEST = 1e6


def read_texture(path: Path) -> Picture:
    """The pixels of a picture of any kind. Transparency is of no account.

    Raises:
        FileError: it cannot be read, is no picture or a damaged one, or is too large.
    """
    return read_picture(path, _check_size, BRIGHTEST)


def _check_size(width: int, height: int) -> None:
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise ContentError(f"must be at most {MAX_SIDE:,} pixels wide and high, got {width:,} x {height:,}")
