"""OpenEXR pictures: named channels, half or float each, in bands of rows; the only user of the library.

The wheel has two ways to write. `OpenEXR.File` wants the whole picture in memory and knows every
attribute; `OpenEXR.OutputFile` takes bands of rows but cannot write matrices (nor chromaticities: it
leaves them 0). Large pictures need the bands, so such attributes are first written as texts of exactly the same
length, and overwritten before the file gets its name.
"""

from __future__ import annotations

import os
import struct
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import Imath  # comes with OpenEXR
import numpy as np
import numpy.typing as npt
import OpenEXR

from clfractal.errors import FileError, Where
from clfractal.files.atomic import atomic_writer, file_error
from clfractal.files.channels import CHANNELS, without_view
from clfractal.files.exr_header import read_header
from clfractal.files.exr_header import read_scene_text as read_scene_text  # part of this module's interface

Floats = npt.NDArray[np.float32]

HALF_MAX = np.float32(65504.0)
"""Largest finite half-precision number."""

# Red, green, blue and white as CIE x, y: Recommendation ITU-R BT.709-6, items 1.3 and 1.4.
_REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)

# Rows handed to the library at once: enough chunks (of 16 rows) for its threads, and little memory.
_ROWS_AT_ONCE = 256
_PIXELS_AT_ONCE = 1 << 20


def write_exr(
    path: str | Path,
    bands: Iterable[Mapping[str, Floats]],
    *,
    display: tuple[int, int],
    region: tuple[int, int, int, int],
    channels: Sequence[str],
    half: Collection[str],
    header: Mapping[str, Any] | None = None,
) -> None:
    """Writes an OpenEXR file, ZIP compressed; it appears complete or not at all.

    Args:
        bands: from top to bottom; channel name -> float32 of shape (rows, width of the region).
        display: width and height of the whole picture, in pixels (the display window).
        region: x, y, width, height of the part that `bands` hold (the data window).
        half: the channels stored as half; the others as float. Finite numbers beyond the range of half
            become +-65504, and so do infinite colours; infinite data (depth) stays infinite.
        header: attribute name -> text, number, sequence of texts (as the standard attribute multiView is), or
            4 x 4 matrix for row vectors (the translation is the last row), as the standard attributes
            worldToCamera and worldToNDC want it.

    Raises:
        FileError: the file cannot be written.
    """
    attributes = {"chromaticities": struct.pack("<8f", *_REC709)}
    plain = _plain_header(display, region, channels, half)
    for name, value in (header or {}).items():
        if isinstance(value, str):
            plain[name] = value.encode()
        elif isinstance(value, bool | int | float | np.number):
            plain[name] = float(value)
        elif isinstance(value, list | tuple) and all(isinstance(each, str) for each in value):
            plain[name] = list(value)  # the library does not write tuples correctly
        else:
            attributes[name] = _matrix_bytes(value)
    kinds = {name: "chromaticities" if name == "chromaticities" else "m44f" for name in attributes}
    for name, data in attributes.items():
        plain[name] = b" " * (len(kinds[name]) + len(data) - len("string"))

    with atomic_writer(path) as beside:
        _write_pixels(path, beside, plain, bands, region, channels, half)
        _replace_attributes(path, beside, {name: (kinds[name], data) for name, data in attributes.items()})


def read_exr(path: str | Path, *, tiles: bool = False) -> tuple[dict[str, npt.NDArray[Any]], dict[str, Any]]:
    """Reads a one-part picture stored by rows: channel -> array (height, width) as stored; and its header.

    With `tiles` the picture may be stored by tiles too; of several levels the largest is read.

    For a damaged file the library may write its own lines to standard error, but here it gives one error.

    Raises:
        FileError: it cannot be read, is not such a file, or is damaged or cut short.
    """
    header = read_header(path)
    if not (header.one_part_flat if tiles else header.one_part_scanlines):
        kinds = "several parts or deep pixels" if tiles else "tiles, several parts or deep pixels"
        raise file_error(path, f"holds {kinds}, which are not read", "")
    try:
        # For pixels that cannot be read the library only prints a line, on Python's standard output.
        with (
            redirect_stdout(StringIO()) as said,
            OpenEXR.File(library_name(path), separate_channels=True) as file,
        ):
            planes = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
        if said.getvalue():
            raise ValueError(said.getvalue())
    except (OSError, RuntimeError, ValueError, TypeError) as error:
        raise FileError(
            "is damaged: its pixels cannot be read", Where(str(path)), details=str(error)
        ) from error
    return planes, header.values()


def library_name(path: str | Path, *, shown: str | Path | None = None) -> bytes:
    """A path as the library takes it: in the bytes that the system itself uses.

    Text it would encode as UTF-8, whatever the system does: it crashes on names that are no UTF-8, and where names have
    another encoding it writes to another place. On Windows it expects UTF-8, which half of a pair of UTF-16 has no form in.

    Args:
        shown: the path that a message names, if it is another one.

    Raises:
        FileError: the path has no such form.
    """
    if sys.platform != "win32":
        return os.fsencode(path)
    try:
        return os.fspath(path).encode()
    except UnicodeEncodeError as error:
        raise FileError(
            "the name of the file or of a folder above it is not valid Unicode", Where(str(shown or path))
        ) from error


def _plain_header(
    display: tuple[int, int],
    region: tuple[int, int, int, int],
    channels: Sequence[str],
    half: Collection[str],
) -> dict[str, Any]:
    """The header entries of every file, in the library's types."""
    pixel = Imath.PixelType
    x, y, width, height = region
    plain: dict[str, Any] = OpenEXR.Header(*display)
    plain["dataWindow"] = Imath.Box2i(Imath.V2i(x, y), Imath.V2i(x + width - 1, y + height - 1))
    plain["compression"] = Imath.Compression(Imath.Compression.ZIP_COMPRESSION)
    plain["channels"] = {
        name: Imath.Channel(pixel(pixel.HALF if name in half else pixel.FLOAT)) for name in channels
    }
    return plain


def _matrix_bytes(value: npt.ArrayLike) -> bytes:
    matrix = np.asarray(value, dtype="<f4")
    if matrix.shape != (4, 4):
        raise ValueError(f"a matrix attribute has 4 x 4 numbers, got shape {matrix.shape}")
    return matrix.tobytes()


def to_half(values: Floats, *, data: bool) -> npt.NDArray[np.float16]:
    """Rounds to half precision; out of range becomes +-65504, but infinite `data` stays infinite."""
    limited = np.clip(values, -HALF_MAX, HALF_MAX)
    result = limited.astype(np.float16)
    if data:
        infinite = np.isinf(values)
        result[infinite] = values[infinite]
    return result


def _as_stored(name: str, planes: Sequence[Floats], half: Collection[str]) -> npt.NDArray[Any]:
    whole = planes[0] if len(planes) == 1 else np.concatenate(planes)
    if name in half:
        channel = CHANNELS.get(without_view(name))
        is_data = channel is not None and channel.kind == "data"
        return np.ascontiguousarray(to_half(whole, data=is_data))
    return np.ascontiguousarray(whole, dtype=np.float32)


def _write_pixels(
    path: str | Path,
    beside: Path,
    plain: Mapping[str, Any],
    bands: Iterable[Mapping[str, Floats]],
    region: tuple[int, int, int, int],
    channels: Sequence[str],
    half: Collection[str],
) -> None:
    """Streams the bands into `beside`; errors speak of `path`."""
    _, _, width, height = region
    rows_at_once = max(1, min(_ROWS_AT_ONCE, _PIXELS_AT_ONCE // width))
    written = 0
    waiting: list[Mapping[str, Floats]] = []

    def flush(file: Any) -> int:
        rows = sum(len(band[channels[0]]) for band in waiting)
        if rows:
            pixels = {name: _as_stored(name, [band[name] for band in waiting], half) for name in channels}
            waiting.clear()
            _library(path, file.writePixels, pixels, rows)
        return rows

    OpenEXR.set_global_thread_count(min(4, os.cpu_count() or 1))
    file = _library(path, OpenEXR.OutputFile, library_name(beside, shown=path), plain)
    try:
        for band in bands:
            waiting.append(band)
            if sum(len(held[channels[0]]) for held in waiting) >= rows_at_once:
                written += flush(file)
        written += flush(file)
    finally:
        _library(path, file.close)
    if written != height:
        raise ValueError(f"a picture of {height} rows got {written}")


def _library(path: str | Path, call: Any, *arguments: Any) -> Any:
    """Calls the library and turns its errors into ours."""
    try:
        return call(*arguments)
    except (OSError, RuntimeError) as error:
        # The last sentence of the library's message: the system's reason, without our temporary file's name.
        reason = str(error).strip().rsplit('". ', 1)[-1].rstrip(".")
        raise file_error(path, "cannot be written", reason) from error


def _replace_attributes(path: str | Path, beside: Path, attributes: Mapping[str, tuple[str, bytes]]) -> None:
    """Writes the attributes over their reservations, once it is sure that the library wrote everything.

    The library does not report that its last bytes did not fit on the disk; reading the header back shows it.
    """
    try:
        header = read_header(beside)
    except FileError as error:
        raise file_error(
            path, "cannot be written: the library left it incomplete (disk full?)", ""
        ) from error
    with open(beside, "r+b") as stream:
        for name, (kind, data) in attributes.items():
            record = f"{name}\0{kind}\0".encode() + struct.pack("<i", len(data)) + data
            reserved = header.attributes[name]
            if len(record) != len(name) + len(reserved.kind) + 6 + len(reserved.data):
                raise ValueError(f"attribute {name} does not fit its place")
            stream.seek(reserved.offset)
            stream.write(record)
