"""PNG pictures, 8 or 16 bits a component, written row by row; the scene travels in a text chunk.

Chunk layout: PNG specification, third edition (W3C 2025), sections 5.3 and 11.3.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt
import png

from clfractal.files.atomic import ContentError, atomic_writer, reading
from clfractal.files.read_ahead import read_ahead
from clfractal.files.srgb import Bits, codes

Floats = npt.NDArray[np.float32]

SIGNATURE = b"\x89PNG\r\n\x1a\n"
SCENE_KEY = "clfractal"
"""Keyword of the text chunk that holds the scene."""

# Components of a pixel by colour type (section 11.2.1), whose byte ends this beginning of a file.
_COMPONENTS = {0: 1, 2: 3, 4: 2, 6: 4}
_TO_COLOR_TYPE = 26
_CHUNK = 1 << 17  # bytes that are compressed at a time: while that is done the next rows are read
_LARGEST_TEXT = 16 << 20  # bytes; a scene with a formula library inlined has some ten thousand


class _Writer(png.Writer):  # type: ignore[misc]
    """pypng's writer, with the colour space and text chunks between the header and the pixels."""

    def __init__(self, *, texts: Mapping[str, str], **settings: object) -> None:
        super().__init__(**settings)
        self.texts = texts

    def write_preamble(self, outfile: BinaryIO) -> None:
        super().write_preamble(outfile)
        png.write_chunk(outfile, b"sRGB", b"\0")  # perceptual, the intent for pictures
        for key, text in self.texts.items():
            # keyword, then: not compressed, no language, no translated keyword
            png.write_chunk(outfile, b"iTXt", key.encode("latin-1") + b"\0\0\0\0\0" + text.encode())


def write_png(
    path: str | Path,
    bands: Iterable[Floats],
    *,
    width: int,
    height: int,
    bits: Bits = 8,
    alpha: bool = False,
    texts: Mapping[str, str] | None = None,
    origin: tuple[int, int] = (0, 0),
) -> None:
    """Writes a PNG file; it appears complete or not at all.

    Args:
        bands: arrays (rows, width, 3), or 4 with `alpha`, from top to bottom: linear Rec. 709, and with
            `alpha` premultiplied by the fourth component. All bands together have `height` rows.
        bits: per component; 8 bits are dithered (see `srgb.encode8`).
        texts: text chunks by keyword (1 to 79 Latin-1 characters), the scene under `SCENE_KEY`.
        origin: picture coordinates (x, y) of the first pixel, for the dither pattern.

    Raises:
        FileError: the file cannot be written.
    """
    with atomic_writer(path) as beside, open(beside, "wb", buffering=1 << 20) as stream:
        stream_png(
            stream, bands, width=width, height=height, bits=bits, alpha=alpha, texts=texts, origin=origin
        )


def write_png_pixels(
    path: str | Path, pixels: npt.NDArray[np.uint8], texts: Mapping[str, str] | None = None
) -> None:
    """Writes finished 8-bit sRGB pixels of shape (height, width, 3); the file appears complete or not at all.

    Raises:
        FileError: the file cannot be written.
    """
    height, width = pixels.shape[:2]
    with atomic_writer(path) as beside, open(beside, "wb", buffering=1 << 20) as stream:
        writer = _Writer(
            width=width, height=height, greyscale=False, bitdepth=8, compression=3, texts=texts or {}
        )
        writer.write_packed(stream, (row.tobytes() for row in pixels))


def read_png_pixels(path: str | Path) -> npt.NDArray[np.uint8]:
    """The pixels of a PNG file of 8-bit colours, shape (height, width, 3).

    Raises:
        FileError: it cannot be read, is no PNG file, or is damaged or cut short.
    """
    with reading(path) as stream:
        try:
            width, height, rows, _ = png.Reader(file=stream).asRGB8()
            # Row by row: the size that a damaged header claims takes no memory.
            found = np.frombuffer(b"".join(bytes(row) for row in rows), np.uint8)
            return found.reshape(height, width, 3)
        except (ValueError, EOFError, zlib.error, png.Error) as error:
            raise ContentError(f"cannot be read: {error}") from error


def stream_png(
    stream: BinaryIO,
    bands: Iterable[Floats],
    *,
    width: int,
    height: int,
    bits: Bits = 8,
    alpha: bool = False,
    texts: Mapping[str, str] | None = None,
    origin: tuple[int, int] = (0, 0),
) -> None:
    """As `write_png`, into a stream that is open."""
    # zlib's level 1 without filters: for dithered pictures filters make files larger, and level 6 takes
    # three times as long for 1 % (measured on a smooth background with a textured disc).
    writer = _Writer(
        width=width,
        height=height,
        greyscale=False,
        alpha=alpha,
        bitdepth=bits,
        compression=1,
        chunk_limit=_CHUNK,
        texts=texts or {},
    )
    written = writer.write_packed(stream, _rows(bands, bits, alpha, origin))
    if written != height:
        raise ValueError(f"a picture of {height} rows got {written}")


def _rows(bands: Iterable[Floats], bits: Bits, alpha: bool, origin: tuple[int, int]) -> Iterator[bytes]:
    """The rows as the file's bytes; their numbers are found while those before are compressed."""
    for code in read_ahead(_codes(bands, bits, alpha, origin)):
        for row in code:
            yield row.tobytes()


def _codes(
    bands: Iterable[Floats], bits: Bits, alpha: bool, origin: tuple[int, int]
) -> Iterator[npt.NDArray[Any]]:
    left, top = origin
    for band in bands:
        code = codes(band, bits, alpha=alpha, origin=(left, top))
        yield code.astype(">u2") if bits == 16 else code
        top += len(band)


def read_texts(path: str | Path) -> dict[str, str]:
    """The text chunks of a PNG file by keyword.

    Raises:
        FileError: it cannot be read, is no PNG file, or is damaged or cut short.
    """
    with reading(path) as stream:
        return _read_texts(stream)


def read_form(path: str | Path) -> tuple[int, int]:
    """Bits of a component, and components of a pixel, of a PNG file; a palette's indices count as one component.

    Raises:
        FileError: it cannot be read, or does not begin as a PNG file.
    """
    with reading(path) as stream:
        start = stream.read(_TO_COLOR_TYPE)
        if len(start) < _TO_COLOR_TYPE or start[:8] != SIGNATURE or start[12:16] != b"IHDR":
            raise ContentError("is not a PNG file")
    bits, color_type = start[24], start[25]
    return bits, _COMPONENTS.get(color_type, 1)


def read_scene_text(path: str | Path) -> str | None:
    """The scene in a PNG file's header, None if it has none.

    Raises:
        FileError: as for `read_texts`.
    """
    return read_texts(path).get(SCENE_KEY)


def _read_texts(stream: BinaryIO) -> dict[str, str]:
    size = os.fstat(stream.fileno()).st_size
    if stream.read(8) != SIGNATURE:
        raise ContentError("is not a PNG file")
    texts: dict[str, str] = {}
    place = 8
    # All chunks are read: a file that was cut short while it was copied is refused, wherever it was cut.
    while True:
        head = stream.read(8)
        length, tag = int.from_bytes(head[:4], "big"), head[4:]
        if len(head) < 8 or place + 12 + length > size:
            raise ContentError("is cut short: the file ends inside its data")
        if place == 8 and tag != b"IHDR":
            raise ContentError("is not a PNG file: it does not begin with a header")
        if tag in (b"IHDR", b"IEND", b"tEXt", b"iTXt"):
            if length > _LARGEST_TEXT:
                raise ContentError(f"is damaged: a text of {length:,} bytes")
            data, check = stream.read(length), stream.read(4)
            if zlib.crc32(tag + data).to_bytes(4, "big") != check:
                raise ContentError(f"is damaged: wrong check sum of its {tag.decode('ascii')} part")
            if tag in (b"tEXt", b"iTXt"):
                texts.update(_text(tag, data))
            if tag == b"IEND":
                return texts
        place += 12 + length
        stream.seek(place)


def _text(tag: bytes, data: bytes) -> dict[str, str]:
    """One text chunk; none if it is compressed (ours are not) or malformed."""
    key, _, rest = data.partition(b"\0")
    name = key.decode("latin-1")
    if tag == b"tEXt":
        return {name: rest.decode("latin-1")}
    parts = rest[2:].split(b"\0", 2)
    if rest[:1] != b"\0" or len(parts) != 3:
        return {}
    try:
        return {name: parts[2].decode()}
    except UnicodeDecodeError:
        return {}
