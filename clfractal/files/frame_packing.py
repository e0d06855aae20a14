"""Tells players of H.264 and H.265 how two eyes' pictures lie in one, by the message of frame packing.

Encoders write none (x265), or none in which the right eye's picture comes first (x264). So the message is made here, by
ITU-T H.264 (08/2021), D.1.26, and ITU-T H.265 (08/2021), D.2.16, and put before the slices of each key picture.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

TYPES: Mapping[str, int] = {
    "checkerboard": 0,
    "columns": 1,
    "rows": 2,
    "split": 3,
    "split_half": 3,
    "over_under": 4,
    "over_under_half": 4,
}
"""H.264's numbers of arrangements (table D-8), by the scene's `stereo.mode`; H.265 knows those from 3 on."""
_CHECKERBOARD = 0

_PAYLOAD = 45
_START, _SHORT_START = b"\0\0\0\1", b"\0\0\1"
_LEFT_FIRST, _RIGHT_FIRST = 1, 2


def arrangements(library: str) -> tuple[str, ...]:
    """The stereo modes that streams of an encoder can tell; of FFmpeg's name of it."""
    least = {"libx264": 0, "libx265": 3}.get(library)
    return () if least is None else tuple(mode for mode, number in TYPES.items() if number >= least)


def frame_packing(library: str, mode: str, *, swap: bool) -> bytes:
    """The message as a NAL unit.

    Args:
        library: libx264 or libx265.
        mode: one of `arrangements`.
        swap: whether the right eye's picture comes first.
    """
    is_h264 = library == "libx264"
    is_checkered = TYPES[mode] == _CHECKERBOARD
    bits = [
        _unsigned(0),  # id
        "0",  # it cancels none
        f"{TYPES[mode]:07b}",
        f"{is_checkered:b}",  # quincunx sampling
        f"{_RIGHT_FIRST if swap else _LEFT_FIRST:06b}",
        "000000",  # nothing is flipped, no fields, and no picture can be decoded without the other
        ""
        if is_checkered
        else f"{0:016b}",  # where samples lie within the whole picture's: at its upper left
        f"{0:08b}",  # reserved
        # It holds until the next one; then no extension, or the pixels' shape is that of the whole picture.
        _unsigned(1) if is_h264 else "1",
        "0",
    ]
    payload = _closed("".join(bits))
    header = b"\x06" if is_h264 else b"\x4e\x01"  # a message before the slices: types 6 and 39
    return _guarded(header + bytes((_PAYLOAD, len(payload))) + payload + b"\x80")


def with_message(data: bytes, message: bytes, library: str) -> bytes:
    """A coded picture, as in Annex B, with a message of `frame_packing` before its first slice."""
    at = data.find(_SHORT_START)
    while 0 <= at < len(data) - 3 and not _is_slice(data[at + 3], library):
        at = data.find(_SHORT_START, at + 3)
    if at < 0:
        return data
    if at > 0 and data[at - 1] == 0:  # a part of the start code
        at -= 1
    return data[:at] + _START + message + data[at:]


def _is_slice(first: int, library: str) -> bool:
    """Whether a NAL unit with this first byte is a part of a picture."""
    return 1 <= first & 31 <= 5 if library == "libx264" else first >> 1 & 63 < 32


def _unsigned(value: int) -> str:
    """A whole number by an Exp-Golomb code: ue(v)."""
    code = format(value + 1, "b")
    return "0" * (len(code) - 1) + code


def _closed(bits: str) -> bytes:
    """The bytes; if bits are missing to a whole one, a one and zeros."""
    if len(bits) % 8:
        bits += "1"
        bits += "0" * (-len(bits) % 8)
    return int(bits, 2).to_bytes(len(bits) // 8, "big")


def _guarded(data: bytes) -> bytes:
    """The bytes of a NAL unit, in which nothing looks like a start code (H.264, 7.4.1.1)."""
    return re.sub(rb"\0\0(?=[\0-\3])", b"\0\0\3", data)
