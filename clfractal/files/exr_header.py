"""Reads the header of an OpenEXR file without the OpenEXR library.

It reads the scenes of untrusted pictures: a damaged or hostile file must give an error of one
line, but a C++ library that reads such a file may crash the process. Layout: "OpenEXR File
Layout", sections "File Layout" and "Header" (openexr.com).
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from clfractal.files.atomic import ContentError, file_error, reading

MAGIC = b"\x76\x2f\x31\x01"
SCENE_ATTRIBUTE = "clfractal"
"""Name of the text attribute that holds the scene."""

_LONGEST_NAME = 255  # bytes, "long names" of version 2
_LARGEST_ATTRIBUTE = 16 << 20  # bytes; ours are below 1 MB, preview pictures of others may be larger
_MOST_ATTRIBUTES = 1000
_TILED, _DEEP, _MULTIPART = 0x200, 0x800, 0x1000
_ROWS_PER_CHUNK = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}  # by compression
_ZIP_AT_MOST = 1100  # deflate makes data at most 1032 times smaller
_PIXEL_BYTES = {0: 4, 1: 2, 2: 4}  # unsigned integer, half, float


@dataclass(frozen=True, slots=True)
class Attribute:
    """One attribute as it lies in the file; `offset` is where its name begins."""

    kind: str
    data: bytes
    offset: int

    def value(self) -> Any:
        """Text, number, tuple of numbers or of texts, or 4 x 4 array; the bytes themselves for other types."""
        data = self.data
        if self.kind == "string":
            return data.decode("utf-8", "replace")
        if self.kind == "stringvector":
            return _texts(data)
        shapes = {"int": "<i", "float": "<f", "double": "<d", "compression": "<B", "lineOrder": "<B"}
        shapes |= {"box2i": "<4i", "v2f": "<2f", "v2i": "<2i", "chromaticities": "<8f", "rational": "<iI"}
        if self.kind == "m44f" and len(data) == 64:
            return np.frombuffer(data, "<f4").reshape(4, 4).astype(np.float32)
        if self.kind in shapes and len(data) == struct.calcsize(shapes[self.kind]):
            numbers = struct.unpack(shapes[self.kind], data)
            return numbers[0] if len(numbers) == 1 else numbers
        return data


@dataclass(frozen=True, slots=True)
class ExrHeader:
    """The (first) header of a file; `end` is where the table of chunk offsets begins in a one-part file."""

    attributes: dict[str, Attribute]
    flags: int
    end: int
    file_size: int

    def values(self) -> dict[str, Any]:
        """All attributes by name; see `Attribute.value`."""
        return {name: attribute.value() for name, attribute in self.attributes.items()}

    @property
    def one_part_scanlines(self) -> bool:
        """Whether the file holds one flat picture stored by rows, as ours do."""
        return not self.flags & (_TILED | _DEEP | _MULTIPART)

    @property
    def one_part_flat(self) -> bool:
        """Whether the file holds one flat picture, stored by rows or by tiles."""
        return not self.flags & (_DEEP | _MULTIPART)

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the channels, in the file's order; those before the first thing that is wrong with the list."""
        attribute = self.attributes.get("channels")
        found = _channel_list(attribute.data if attribute else b"")
        return tuple(name.decode("utf-8", "replace") for name, _ in found)


def _texts(data: bytes) -> tuple[str, ...]:
    """Texts that each begin with their length in bytes; those before the first thing that is wrong."""
    found, place = [], 0
    while place + 4 <= len(data):
        (length,) = struct.unpack_from("<i", data, place)
        if not 0 <= length <= len(data) - place - 4:
            break
        found.append(data[place + 4 : place + 4 + length].decode("utf-8", "replace"))
        place += 4 + length
    return tuple(found)


def read_header(path: str | Path) -> ExrHeader:
    """The header of an OpenEXR file; for one-part scanline files it also checks that the pixel data are complete.

    Raises:
        FileError: it cannot be read, is no OpenEXR file, or is damaged or cut short.
    """
    with reading(path) as stream:
        header = _parse(stream)
        if header.one_part_scanlines:
            _check_whole(stream, header)
        return header


def read_scene_text(path: str | Path) -> str | None:
    """The scene in an OpenEXR file's header, None if it has none.

    Raises:
        FileError: as for `read_header`, and if the scene is no UTF-8 text.
    """
    attribute = read_header(path).attributes.get(SCENE_ATTRIBUTE)
    if attribute is None or attribute.kind != "string":
        return None
    try:
        return attribute.data.decode()
    except UnicodeDecodeError:
        raise file_error(path, "is damaged: its scene is not UTF-8 text", "") from None


def _exactly(stream: BinaryIO, size: int) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise ContentError("is cut short: the file ends inside its header")
    return data


def _name(stream: BinaryIO) -> str:
    """A name that ends with a zero byte; empty at the end of the header."""
    start = stream.tell()
    piece = stream.read(_LONGEST_NAME + 1)
    name, zero, _ = piece.partition(b"\0")
    if not zero:
        cut = len(piece) <= _LONGEST_NAME
        raise ContentError(
            "is cut short: the file ends inside its header" if cut else "is damaged: an endless name"
        )
    stream.seek(start + len(name) + 1)
    return name.decode("utf-8", "replace")


def _parse(stream: BinaryIO) -> ExrHeader:
    size = os.fstat(stream.fileno()).st_size
    if stream.read(4) != MAGIC:
        raise ContentError("is not an OpenEXR file")
    (version,) = struct.unpack("<I", _exactly(stream, 4))
    if version & 0xFF != 2:
        raise ContentError(f"is an OpenEXR file of version {version & 0xFF}; only version 2 is known")
    attributes: dict[str, Attribute] = {}
    while True:
        offset = stream.tell()
        name = _name(stream)
        if not name:
            return ExrHeader(attributes, version & ~0xFF, stream.tell(), size)
        kind = _name(stream)
        (length,) = struct.unpack("<i", _exactly(stream, 4))
        if not 0 <= length <= _LARGEST_ATTRIBUTE or len(attributes) >= _MOST_ATTRIBUTES:
            raise ContentError("is damaged: its header is not valid")
        attributes[name] = Attribute(kind, _exactly(stream, length), offset)


def _channel_list(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """The names of channels, and what is told of each; less than 16 bytes where the list ends too early."""
    while data and data[0]:
        name, _, rest = data.partition(b"\0")
        yield name, rest[:16]
        data = rest[16:]


def _channel_bytes(data: bytes) -> int:
    """Bytes of one pixel: the sum over the channel list."""
    total, length = 0, 1
    for name, told in _channel_list(data):
        if len(told) < 16:
            break
        kind, across, down = struct.unpack("<i4xii", told)
        if kind not in _PIXEL_BYTES or across != 1 or down != 1:
            raise ContentError("is damaged, or has sub-sampled channels")
        total += _PIXEL_BYTES[kind]
        length += len(name) + 17
    if data[length - 1 :] != b"\0" or not total:
        raise ContentError("is damaged: its list of channels is not valid")
    return total


def _check_whole(stream: BinaryIO, header: ExrHeader) -> None:
    """Refuses a file that ends before its last chunk, or promises more pixels than it can hold."""
    values = header.values()
    try:
        (left, top, right, bottom), compression = values["dataWindow"], values["compression"]
        pixel_bytes = _channel_bytes(header.attributes["channels"].data)
    except (KeyError, TypeError, ValueError):
        raise ContentError("is damaged: its header lacks required attributes") from None
    width, height = right - left + 1, bottom - top + 1
    if width < 1 or height < 1 or compression not in _ROWS_PER_CHUNK:
        raise ContentError("is damaged: its size or compression is impossible")
    if compression <= 3 and width * height * pixel_bytes > _ZIP_AT_MOST * header.file_size:
        raise ContentError("is cut short or damaged: it is too small for the picture it promises")
    rows = _ROWS_PER_CHUNK[compression]
    count = (height + rows - 1) // rows
    table_end = header.end + 8 * count
    cut_short = ContentError("is cut short: the file ends inside its pixels")
    if table_end > header.file_size:
        raise cut_short
    stream.seek(header.end)
    offsets = np.frombuffer(_exactly(stream, 8 * count), "<u8")
    # (Of a file that was never finished the library leaves zeros in the table.)
    if offsets.min() < table_end or offsets.max() + np.uint64(8) > header.file_size:
        raise cut_short
    last = int(offsets.max())
    stream.seek(last + 4)
    (length,) = struct.unpack("<i", _exactly(stream, 4))
    if length < 0 or last + 8 + length > header.file_size:
        raise cut_short
