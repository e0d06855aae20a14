"""Reads sound: RIFF WAVE files of whole numbers or floats, of any rate and number of channels."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clfractal.errors import FileError, Where
from clfractal.files.regular import read_bytes

MAX_BYTES = 2**31
_WHOLE, _FLOAT, _EXTENSIBLE = 1, 3, 0xFFFE
_RATES = (1_000, 768_000)


@dataclass(frozen=True, slots=True)
class Sound:
    """A sound, its channels averaged.

    Attributes:
        samples: shape (n,); full scale is -1 to 1.
        rate: samples per second.
    """

    samples: npt.NDArray[np.float32]
    rate: int

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return len(self.samples) / self.rate


def read_sound(path: Path) -> Sound:
    """Reads a WAV file.

    Raises:
        FileError: it cannot be read, is too large, no WAV file, cut short, or of a kind that is not read.
    """
    name = str(path)
    content = read_bytes(path, limit=MAX_BYTES)
    if content[:4] != b"RIFF" or content[8:12] != b"WAVE":
        raise FileError("is no WAV file", Where(name))
    form: bytes | None = None
    for kind, piece in _chunks(content):
        if kind == b"fmt ":
            form = piece
        elif kind == b"data":
            if form is None:
                raise FileError("is damaged: its sound comes before its form", Where(name))
            return _decoded(form, piece, name)
    raise FileError("holds no sound", Where(name))


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """The pieces of a RIFF file: kind and content. One that is cut short is as long as the file."""
    at = 12
    while at + 8 <= len(content):
        kind, size = struct.unpack_from("<4sI", content, at)
        yield kind, content[at + 8 : at + 8 + size]
        at += 8 + size + size % 2


def _decoded(form: bytes, data: bytes, name: str) -> Sound:
    if len(form) < 16:
        raise FileError("is damaged: its form is cut short", Where(name))
    kind, channels, rate, _, width, bits = struct.unpack_from("<HHIIHH", form)
    if kind == _EXTENSIBLE and len(form) >= 26:
        (kind,) = struct.unpack_from("<H", form, 24)
    known = (kind == _WHOLE and bits in (8, 16, 24, 32)) or (kind == _FLOAT and bits in (32, 64))
    if not known:
        raise FileError(
            "must hold whole numbers of 8 to 32 bits, or floats; convert it to a WAV of 16 bits", Where(name)
        )
    if not (1 <= channels <= 64 and _RATES[0] <= rate <= _RATES[1] and width == channels * bits // 8):
        raise FileError("is damaged: its form makes no sense", Where(name))
    whole = data[: len(data) // width * width]
    with np.errstate(all="ignore"):  # what is out of range is refused below
        numbers = _numbers(whole, kind, bits).reshape(-1, channels)
        samples = numbers.mean(axis=1, dtype=np.float64).astype(np.float32)
    if not len(samples):
        raise FileError("holds no sound", Where(name))
    if not np.isfinite(samples).all():
        raise FileError("holds numbers that are not finite", Where(name))
    return Sound(samples, rate)


def _numbers(data: bytes, kind: int, bits: int) -> npt.NDArray[np.float32]:
    if kind == _FLOAT:
        return np.frombuffer(data, "<f4" if bits == 32 else "<f8").astype(np.float32)
    if bits == 8:  # the only one without a sign
        return ((np.frombuffer(data, np.uint8) - 128.0) / 128).astype(np.float32)
    if bits == 24:
        bytes_ = np.frombuffer(data, np.uint8).reshape(-1, 3)
        wide = np.zeros((len(bytes_), 4), np.uint8)
        wide[:, 1:] = bytes_
        return (wide.view("<i4")[:, 0] / 2.0**31).astype(np.float32)
    numbers: npt.NDArray[np.integer] = np.frombuffer(data, f"<i{bits // 8}")
    return (numbers / 2.0 ** (bits - 1)).astype(np.float32)
