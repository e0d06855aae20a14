"""Reads Radiance's pictures (`.hdr`, RGBE and XYZE).

Ward, Real Pixels, Graphics Gems II (1991), and the Radiance file formats reference (picture files).

A file is a header of text lines, a line with its size, and rows of pixels of four bytes: three mantissas that share an
exponent. Rows lie flat, in runs of whole pixels (before 1991), or with each byte of the pixels in runs of its own.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from clfractal.files.atomic import ContentError

MAGIC = (b"#?RADIANCE", b"#?RGBE")
_LONGEST_HEADER = 1 << 16
_SIZE = re.compile(rb"([-+])([XY]) (\d{1,9}) ([-+])([XY]) (\d{1,9})")
_RUN_WIDTHS = range(8, 0x8000)  # of rows whose bytes have runs of their own

Floats = npt.NDArray[np.float32]
Bytes = npt.NDArray[np.uint8]


@dataclass(slots=True)
class RadianceHeader:
    """What stands before the pixels; `rows` and `columns` as they lie in the file, `start` where they begin.

    `size`: width and height of the picture, which `flips` and `is_turned` give from the rows.
    """

    is_xyz: bool = False
    exposure: float = 1.0
    correction: tuple[float, ...] = (1.0, 1.0, 1.0)
    primaries: tuple[float, ...] | None = None
    rows: int = 0
    columns: int = 0
    is_turned: bool = False
    flips: tuple[bool, bool] = (False, False)
    start: int = 0
    lines: list[str] = field(default_factory=list)

    @property
    def size(self) -> tuple[int, int]:
        return (self.rows, self.columns) if self.is_turned else (self.columns, self.rows)


def read_radiance_header(data: bytes) -> RadianceHeader:
    """The header of a file with these bytes.

    Raises:
        ContentError: it is damaged, or says what no picture says.
    """
    header = RadianceHeader()
    end = data.find(b"\n\n", 0, _LONGEST_HEADER)
    if end < 0:
        raise ContentError("is damaged: its header has no end")
    stop = data.find(b"\n", end + 2, end + 200)
    size = _SIZE.fullmatch(data[end + 2 : max(stop, 0)])
    if size is None or size[2] == size[5]:
        raise ContentError("is damaged: the line with its size is missing")
    for line in data[:end].decode("latin-1").split("\n")[1:]:
        _take(header, line.strip())
    header.is_turned = size[2] == b"X"
    # Rows go down and columns to the right if the file says "-Y height +X width".
    header.flips = (
        size[1] == (b"-" if header.is_turned else b"+"),
        size[4] == (b"+" if header.is_turned else b"-"),
    )
    header.rows, header.columns = int(size[3]), int(size[6])
    header.start = stop + 1
    return header


def _take(header: RadianceHeader, line: str) -> None:
    name, _, value = line.partition("=")
    if name == "FORMAT":
        if value not in ("32-bit_rle_rgbe", "32-bit_rle_xyze"):
            raise ContentError(f"is a Radiance picture of an unknown format, {value[:60]!r}")
        header.is_xyz = value.endswith("xyze")
    elif name in ("EXPOSURE", "COLORCORR", "PRIMARIES"):
        try:
            numbers = tuple(float(part) for part in value.split())
        except ValueError:
            raise ContentError(f"is damaged: its {name} is no number") from None
        wanted = {"EXPOSURE": 1, "COLORCORR": 3, "PRIMARIES": 8}[name]
        if len(numbers) != wanted or not np.isfinite(numbers).all():
            raise ContentError(f"is damaged: its {name} has not {wanted} numbers")
        if name == "PRIMARIES":
            header.primaries = numbers
        elif min(numbers) <= 0:
            raise ContentError(f"is damaged: its {name} is not above 0")
        elif name == "EXPOSURE":  # all that a file names were applied one after the other
            header.exposure *= numbers[0]
        else:
            header.correction = tuple(a * b for a, b in zip(header.correction, numbers, strict=True))


def radiance_pixels(data: bytes, header: RadianceHeader) -> Floats:
    """Red, green and blue or X, Y and Z, shape (height, width, 3), before any exposure that the header names.

    Raises:
        ContentError: the pixels are damaged, or not all there.
    """
    rows = _rows(data, header)
    exponents = rows[..., 3]
    # (m + 0.5) 2^(e - 136): writers cut the mantissa off. An exponent of 0 is black.
    scale = np.ldexp(np.float32(1), exponents.astype(np.int32) - 136)
    scale[exponents == 0] = 0
    factors = 1 / (header.exposure * np.array(header.correction))
    pixels = (rows[..., :3] + np.float32(0.5)) * scale[..., None] * factors.astype(np.float32)
    if header.is_turned:
        pixels = pixels.swapaxes(0, 1)
        down, right = header.flips[1], header.flips[0]
    else:
        down, right = header.flips
    pixels = pixels[:: -1 if down else 1, :: -1 if right else 1]
    return np.ascontiguousarray(pixels, np.float32)


def _rows(data: bytes, header: RadianceHeader) -> Bytes:
    found = np.zeros((header.rows, header.columns, 4), np.uint8)
    place = header.start
    for row in found:
        start = data[place : place + 4]
        if header.columns in _RUN_WIDTHS and start[:2] == b"\2\2" and len(start) == 4 and start[2] < 128:
            if start[2] << 8 | start[3] != header.columns:
                raise ContentError("is damaged: a row has another length than the picture")
            place = _row_of_runs(data, place + 4, row)
        else:
            place = _row_of_pixels(data, place, row)
    return found


def _row_of_runs(data: bytes, place: int, row: Bytes) -> int:
    """A row whose four kinds of bytes follow each other, in runs: above 128 one byte again and again, else as they are."""
    width = len(row)
    for part in range(4):
        at = 0
        line = bytearray()
        while at < width:
            count = data[place] if place < len(data) else 0
            if count > 128:
                count -= 128
                piece = data[place + 1 : place + 2] * count
                place += 2
            else:
                piece = data[place + 1 : place + 1 + count]
                place += 1 + count
            if not count or len(piece) != count or at + count > width:
                raise ContentError("is damaged: its pixels end too early or go beyond their row")
            line += piece
            at += count
        row[:, part] = np.frombuffer(line, np.uint8)
    return place


def _row_of_pixels(data: bytes, place: int, row: Bytes) -> int:
    """A row of whole pixels, in which (1, 1, 1, n) stands for n more like the last; several after each other are digits
    of 8 bits, the lowest first."""
    width = len(row)
    flat = np.frombuffer(
        data, np.uint8, count=min(4 * width, len(data) - place) // 4 * 4, offset=place
    ).reshape(-1, 4)
    if len(flat) == width and not (flat[:, :3] == 1).all(axis=1).any():
        row[:] = flat
        return place + 4 * width
    at = shift = 0
    while at < width:
        pixel = data[place : place + 4]
        if len(pixel) < 4:
            raise ContentError("is damaged: its pixels end too early or go beyond their row")
        place += 4
        if pixel[:3] == b"\1\1\1":
            count = pixel[3] << shift
            shift += 8
            if not at or shift > 32 or at + count > width:
                raise ContentError("is damaged: its pixels end too early or go beyond their row")
            row[at : at + count] = row[at - 1]
            at += count
        else:
            row[at] = np.frombuffer(pixel, np.uint8)
            at += 1
            shift = 0
    return place
