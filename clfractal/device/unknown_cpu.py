"""Processors that are younger than the compiler in PoCL's wheel.

The wheel of PoCL 3.0 has LLVM 14, which calls a processor that it does not know (AMD's Zen 5) "generic", and then refuses
that very name: "unknown target CPU 'generic'" (PoCL's issues 512 and 1049). So nothing at all could be compiled. AMD's
Zen 4 it takes for a Zen 3, which has no AVX-512: vectors of 16 numbers, for which PoCL brings functions with AVX-512, then
make the compiler abort, and those of 8 are slower.

No variable changes the name. It stands in the device's record, beside the target's triple; there it is replaced by the
nearest processor that the compiler knows. The record is recognised by what it holds, and read through the system, which
gives an error where a program would crash. A driver that is built in another way is left as it is.
"""

from __future__ import annotations

import ctypes
import struct
import sys
from collections.abc import Callable, Set
from contextlib import suppress
from pathlib import Path

Read = Callable[[int, int], bytes]
"""So many bytes of this process's memory, from an address on; empty if there is none."""

_TRIPLE = b"x86_64-unknown-linux-gnu"
# Names that are wrong; and those that are, only if the processor has what the best name needs.
_UNKNOWN, _TOO_OLD = b"generic", frozenset({b"znver1", b"znver2", b"znver3"})
# Bytes of a device's record that are looked at, in which PoCL has its texts; and of a pointer. Behind a record there may be
# that of another device.
_RECORD, _POINTER = 768, 8
# Names that LLVM 14 knows, the best first, and what a processor must have for each, as Linux calls it.
_KNOWN: tuple[tuple[bytes, frozenset[str]], ...] = (
    (
        b"skylake-avx512",
        frozenset(
            {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl", "avx2", "fma", "bmi1", "bmi2", "adx"}
        ),
    ),
    (b"haswell", frozenset({"avx2", "fma", "bmi1", "bmi2", "movbe", "f16c", "abm"})),
    (b"x86-64", frozenset()),
)
# By device: the text that its record points to now, for as long as the process lives.
_texts: dict[int, ctypes.Array[ctypes.c_char]] = {}


def name_processor(device: int) -> bytes | None:
    """Gives PoCL's device the processor that its compiler should build for; a second call does nothing.

    Returns:
        The name that the device was given; None if it has a right one of its own.

    Args:
        device: the address of its record, which is what an OpenCL device is to a program.
    """
    if device in _texts:
        return _texts[device].value
    if sys.platform != "linux" or struct.calcsize("P") != _POINTER:
        return None
    with suppress(OSError), open("/proc/self/mem", "rb", buffering=0) as memory:

        def read(address: int, size: int) -> bytes:
            try:
                memory.seek(address)
                return memory.read(size)
            except (OSError, OverflowError, ValueError):
                return b""

        name = nearest_known(processor_features())
        place = place_of_name(device, read, best=name == _KNOWN[0][0])
        if place is None:
            return None
        text = _texts[device] = ctypes.create_string_buffer(name)
        ctypes.memmove(place, struct.pack("<Q", ctypes.addressof(text)), _POINTER)
        return name
    return None


def place_of_name(device: int, read: Read, *, best: bool = False) -> int | None:
    """Where a device's record points to the wrong name of a processor; None if it does not.

    Args:
        device: the record's address.
        read: reads memory.
        best: whether the processor has all that the best known one has.
    """
    wrong = {_UNKNOWN, *(_TOO_OLD if best else ())}
    record = read(device, _RECORD)
    count = len(record) // _POINTER
    pointers = struct.unpack(f"<{count}Q", record[: count * _POINTER])
    for index in range(count - 1):
        triple, name = (_text(pointer, read) for pointer in pointers[index : index + 2])
        if triple == _TRIPLE:
            return device + (index + 1) * _POINTER if name in wrong else None
    return None


def nearest_known(features: Set[str]) -> bytes:
    """The best processor that the compiler knows and whose instructions one with these features has."""
    return next(name for name, needed in _KNOWN if needed <= features)


def processor_features(path: Path = Path("/proc/cpuinfo")) -> frozenset[str]:
    """What the processor can do, in Linux's words; nothing if that is not known."""
    with suppress(OSError):
        for line in path.read_text(errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "flags":
                return frozenset(value.split())
    return frozenset()


def _text(address: int, read: Read) -> bytes:
    longest = len(_TRIPLE) + 1
    found, end, _ = read(address, longest).partition(b"\0")
    return found if end else b""
