"""The voxels of a volume file: as they lie in it, as text, or compressed.

No more memory is taken than the header asks for, and none before the file is known to be large enough.
"""

from __future__ import annotations

import bz2
import gzip
import math
import os
import zlib
from collections.abc import Callable
from contextlib import suppress
from typing import IO, Any, BinaryIO, cast

import numpy as np
import numpy.typing as npt

from clfractal.files import memory
from clfractal.files.atomic import ContentError
from clfractal.files.nrrd import COMPRESSED, Header

Values = npt.NDArray[Any]
Shape = tuple[int, int, int]

_MAPPED = 64 << 20  # bytes; smaller data are read: a mapped file that is cut short later ends the process
_PIECE = 1 << 20  # bytes read at once, so that Ctrl-C is heard in between
_DEFLATE_AT_MOST = 1032  # times smaller, by the format itself
_LONGEST_WORD = (
    400  # characters of a number; the largest float64 without an exponent has 309 before its point
)
_SPACE = b" \t\n\r\v\f"


def read(stream: BinaryIO, head: Header, offset: int, limit: int | None) -> Values:
    """The voxels of a NRRD file.

    Args:
        stream: the file that holds them.
        offset: where the data may begin: behind an attached header.
        limit: as for `read_volume`.

    Raises:
        ContentError: they are damaged, cut short, or too large for memory.
    """
    if head.encoding in COMPRESSED:
        return _unpacked(stream, head, offset, limit)
    size = os.fstat(stream.fileno()).st_size
    offset = _after_lines(stream, offset, head.line_skip)
    if head.encoding == "raw":
        need = math.prod(head.shape) * head.dtype.itemsize
        offset = max(offset, size - need) if head.byte_skip < 0 else offset + head.byte_skip
        return plain(stream, head.dtype, head.shape, offset, limit)
    offset += head.byte_skip
    stream.seek(min(offset, size))
    digits = _words if head.encoding == "ascii" else _hexadecimal
    return digits(stream, head, max(size - offset, 0), limit)


def plain(
    stream: BinaryIO,
    dtype: np.dtype[Any],
    shape: Shape,
    offset: int,
    limit: int | None,
) -> Values:
    """Values as they lie in the file from `offset` on: mapped if there are many."""
    size, need = os.fstat(stream.fileno()).st_size, math.prod(shape) * dtype.itemsize
    if size - offset < need:
        raise ContentError(
            f"is cut short: {_sides(shape)} need {need:,} bytes, it has {max(0, size - offset):,}"
        )
    native = dtype.newbyteorder("=")
    if need >= _MAPPED and dtype == native:
        return np.memmap(stream, dtype, "r", offset, shape)
    values = room(native, shape, limit)
    stream.seek(offset)
    _fill(values, lambda wanted: stream.readinto(wanted))  # type: ignore[attr-defined]
    return _native(values, dtype)


def room(dtype: np.dtype[Any], shape: Shape, limit: int | None) -> Values:
    """Memory for values, if there is enough."""
    need, have = math.prod(shape) * dtype.itemsize, memory.available() if limit is None else limit
    if need > have:
        raise ContentError(
            f"is too large: {_sides(shape)} need {memory.shown(need)} of memory, {memory.shown(have)} are left"
        )
    return np.empty(shape, dtype)


def _fill(values: Values, read_into: Callable[[memoryview], int]) -> None:
    """Reads the bytes of all values, piece by piece."""
    raw: Any = values.reshape(-1).view(np.uint8)
    for start in range(0, len(raw), _PIECE):
        wanted = memoryview(raw[start : start + _PIECE])
        while len(wanted):
            count = read_into(wanted)
            if not count:
                raise ContentError("is cut short: the file ends inside its data")
            wanted = wanted[count:]


def _native(values: Values, dtype: np.dtype[Any]) -> Values:
    """Values whose bytes were read in a file's order, in the machine's."""
    if dtype != values.dtype:
        values.byteswap(inplace=True)
    return values


def _after_lines(stream: BinaryIO, offset: int, lines: int) -> int:
    """The place after some lines; a file without that many ends the search."""
    stream.seek(offset)
    while lines:
        piece = stream.readline(_PIECE)
        if not piece:
            raise ContentError("is cut short: it has fewer lines than its header skips")
        lines -= piece.endswith(b"\n")
    return stream.tell()


def _sides(shape: Shape) -> str:
    return f"{shape[2]:,} x {shape[1]:,} x {shape[0]:,} voxels"


# --- compressed ---


def _unpacked(stream: BinaryIO, head: Header, offset: int, limit: int | None) -> Values:
    """Values packed by gzip or bzip2; never more is unpacked than the header tells."""
    size = os.fstat(stream.fileno()).st_size
    need = math.prod(head.shape) * head.dtype.itemsize
    if head.encoding == "gzip" and need + head.byte_skip > (size - offset) * _DEFLATE_AT_MOST:
        raise ContentError(
            f"is cut short: {_sides(head.shape)} need {need:,} bytes, which {max(0, size - offset):,}"
            " compressed ones cannot hold"
        )
    values = room(head.dtype.newbyteorder("="), head.shape, limit)
    stream.seek(offset)
    try:
        opened = gzip.GzipFile(fileobj=stream) if head.encoding == "gzip" else bz2.BZ2File(stream)
        with cast(IO[bytes], opened) as unpacked:
            left = head.byte_skip
            while left and (skipped := len(unpacked.read(min(left, _PIECE)))):
                left -= skipped
            _fill(values, lambda wanted: _into(unpacked, wanted))
            unpacked.read(1)  # at the end of the data their check sum is compared
    except EOFError as error:
        raise ContentError("is cut short: its compressed data end too early") from error
    except (OSError, zlib.error) as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise  # not the data's fault
        raise ContentError("is damaged: its compressed data are wrong") from error
    return _native(values, head.dtype)


def _into(unpacked: IO[bytes], wanted: memoryview) -> int:
    count: int = unpacked.readinto(wanted)  # type: ignore[attr-defined]
    if not count:
        raise EOFError
    return count


# --- as text ---


def _words(stream: BinaryIO, head: Header, size: int, limit: int | None) -> Values:
    """Numbers between spaces, line ends or commas; what comes after the last that is asked for is not looked at."""
    count = math.prod(head.shape)
    if size < 2 * count - 1:
        raise ContentError(
            f"is cut short: {_sides(head.shape)} need {2 * count - 1:,} characters or more, it has {size:,}"
        )
    values = room(head.dtype, head.shape, limit)
    flat, filled, rest = values.reshape(-1), 0, b""
    while filled < count:
        piece = stream.read(_PIECE)
        words = (rest + piece).replace(b",", b" ").split()
        # The last word may go on in the next piece.
        goes_on = piece and not piece[-1:].isspace() and piece[-1:] != b","
        rest = words.pop() if goes_on else b""
        if len(rest) > _LONGEST_WORD:
            raise _no_number(filled + len(words), rest, head)
        words = words[: count - filled]
        flat[filled : filled + len(words)] = _numbers(words, filled, head)
        filled += len(words)
        if not piece and filled < count:
            raise ContentError(f"is cut short: {_sides(head.shape)}, but {filled:,} numbers")
    return values


def _numbers(words: list[bytes], before: int, head: Header) -> Values:
    """Words as numbers of the header's type; `before`: how many came before them."""
    found = None
    with suppress(ValueError):
        found = _parsed(words, head)
    if found is None:
        wrong = next(n for n, word in enumerate(words) if not _is_number(word, head))
        raise _no_number(before + wrong, words[wrong], head)
    with np.errstate(over="ignore"):  # what a float32 cannot hold becomes infinite
        return np.array(found, head.dtype)


def _parsed(words: list[bytes], head: Header) -> list[float]:
    """Words as numbers; ValueError if any is none of the header's type."""
    if any(b"_" in word for word in words):  # which Python would leave out
        raise ValueError
    if head.dtype.kind == "f":
        return list(map(float, words))
    found, limits = list(map(int, words)), np.iinfo(cast(Any, head.dtype))
    if found and not (limits.min <= min(found) and max(found) <= limits.max):
        raise ValueError
    return cast(list[float], found)


def _is_number(word: bytes, head: Header) -> bool:
    try:
        _parsed([word], head)
    except ValueError:
        return False
    return True


def _no_number(number: int, word: bytes, head: Header) -> ContentError:
    shown = word[:40].decode("utf-8", "replace")
    return ContentError(f"is damaged: its number {number + 1:,} is {shown!r}, which is no {head.dtype}")


def _hexadecimal(stream: BinaryIO, head: Header, size: int, limit: int | None) -> Values:
    """Two digits for each byte, with spaces and line ends anywhere."""
    need = math.prod(head.shape) * head.dtype.itemsize
    if size < 2 * need:
        raise ContentError(
            f"is cut short: {_sides(head.shape)} need {2 * need:,} digits, it has {size:,} characters"
        )
    values = room(head.dtype.newbyteorder("="), head.shape, limit)
    rest = b""

    def read_into(wanted: memoryview) -> int:
        nonlocal rest
        while len(rest) < 2 and (piece := stream.read(min(_PIECE, 2 * len(wanted)))):
            rest += piece.translate(None, _SPACE)
        count = min(len(rest) // 2, len(wanted))
        digits, rest = rest[: 2 * count], rest[2 * count :]
        try:
            found = bytes.fromhex(digits.decode("ascii"))
        except ValueError:
            raise ContentError("is damaged: its data are not hexadecimal") from None
        wanted[:count] = found
        return count

    _fill(values, read_into)
    return _native(values, head.dtype)
