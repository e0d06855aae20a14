"""Processors that PoCL's wheel does not know get the name of one that it does."""

from __future__ import annotations

import ctypes
import struct
import sys
from pathlib import Path

import pytest

from clfractal.device import unknown_cpu
from clfractal.device.select import devices as all_devices
from clfractal.device.select import is_pocl
from clfractal.device.unknown_cpu import nearest_known, place_of_name, processor_features
from tests.shell import python, works

TRIPLE = b"x86_64-unknown-linux-gnu"


class Memory:
    """A record of pointers to texts, at addresses of its own."""

    def __init__(self, *texts: bytes | int) -> None:
        self.parts: dict[int, bytes] = {}
        pointers = []
        for place, text in enumerate(texts):
            if isinstance(text, int):
                pointers.append(text)
                continue
            pointers.append(0x10000 + 0x100 * place)
            self.parts[pointers[-1]] = text + b"\0" + b"rest"
        self.parts[0x1000] = struct.pack(f"<{len(pointers)}Q", *pointers)

    def read(self, address: int, size: int) -> bytes:
        return self.parts.get(address, b"")[:size]


def test_the_name_beside_the_triple_is_found() -> None:
    memory = Memory(7, b"pthread", b"generic", 0, TRIPLE, b"generic", 2**63)
    assert place_of_name(0x1000, memory.read) == 0x1000 + 5 * 8


def test_the_name_of_an_older_processor_is_wrong_for_one_with_wide_vectors() -> None:
    memory = Memory(b"pthread", TRIPLE, b"znver3")
    assert place_of_name(0x1000, memory.read) is None
    assert place_of_name(0x1000, memory.read, best=True) == 0x1000 + 2 * 8


def test_the_record_of_a_neighbour_is_not_looked_at() -> None:
    memory = Memory(*[b"text"] * 100, TRIPLE, b"generic")
    assert place_of_name(0x1000, memory.read) is None


@pytest.mark.parametrize(
    "texts",
    [
        (b"pthread", TRIPLE, b"skylake-avx512", b"generic"),
        (b"generic", b"nvptx64-nvidia", b"generic"),
        (b"pthread", TRIPLE),
        (),
    ],
)
def test_other_records_stay_as_they_are(texts: tuple[bytes, ...]) -> None:
    assert place_of_name(0x1000, Memory(*texts).read) is None


def test_a_processor_gets_the_best_name_whose_instructions_it_has() -> None:
    old, wide = {"sse2", "fpu"}, {"avx2", "fma", "bmi1", "bmi2", "movbe", "f16c", "abm", "adx"}
    widest = wide | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
    assert [nearest_known(each) for each in (set(), old, wide, widest)] == [
        b"x86-64",
        b"x86-64",
        b"haswell",
        b"skylake-avx512",
    ]


def test_features_are_read_where_linux_tells_them(tmp_path: Path) -> None:
    told = tmp_path / "cpuinfo"
    told.write_text("processor\t: 0\nflags\t\t: fpu avx2 fma\nprocessor\t: 1\nflags\t\t: other\n")
    assert processor_features(told) == {"fpu", "avx2", "fma"}
    assert processor_features(tmp_path / "none") == frozenset()


@pytest.mark.skipif(sys.platform != "linux", reason="reads Linux's file of a process's memory")
def test_memory_of_the_process_itself_is_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unknown_cpu, "processor_features", frozenset)
    monkeypatch.setattr(unknown_cpu, "_texts", {})
    texts = [ctypes.create_string_buffer(text) for text in (b"pthread", TRIPLE, b"generic")]
    record = (ctypes.c_uint64 * 512)(*(ctypes.addressof(text) for text in texts))
    assert unknown_cpu.name_processor(ctypes.addressof(record)) == b"x86-64"
    assert ctypes.string_at(record[2]) == b"x86-64"
    assert unknown_cpu.name_processor(ctypes.addressof(record)) == b"x86-64"
    assert unknown_cpu.name_processor(8) is None  # where there is no memory


def test_every_pocl_device_compiles() -> None:
    """In a process of its own each, with nothing but what the program does when it looks for devices."""
    program = (
        "import sys, pyopencl as cl; from clfractal.device.select import devices\n"
        "device = next(each for each in devices() if each.index == sys.argv[1])\n"
        "from clfractal.device.select import choose\n"
        "chosen = choose(device.index)\n"
        "cl.Program(chosen.context, '__kernel void a(__global float *x) { x[0] = sin(x[0]); }').build()\n"
    )
    found = [info.index for info in all_devices() if is_pocl(info)]
    for index in found:
        works(python(program, index))
