"""Programs: built once, kept with their machine code, and errors that know our own files."""

from __future__ import annotations

import dataclasses
import statistics
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

from clfractal.device import cache, compiler, driver_files, drivers_folder, isolate
from clfractal.device.compiler import Argument, Warm
from clfractal.device.loaded import MOST, LoadedPrograms
from clfractal.device.program import Program, build, math_flags
from clfractal.device.select import Device, is_pocl
from clfractal.device.source import flatten
from clfractal.errors import DeviceError, KernelBuildError
from tests.calls import failure, raising

pytestmark = pytest.mark.conformance

_TRIPLE = "__kernel void triple(__global float *a, float by) { a[get_global_id(0)] *= by; }\n"
_FLAGS = math_flags("float32")
_WARM = Warm("triple", (8,), (1,), (Argument("buffer", 32), Argument("scalar", dtype="float32", value=2.0)))


def _triples(program: Program) -> bool:
    device = program.device
    values = np.arange(8, dtype=np.float32)
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    buffer = cl.Buffer(device.context, flags, hostbuf=values)
    kernel = program.kernel("triple")
    kernel.set_args(buffer, np.float32(3))
    cl.enqueue_nd_range_kernel(device.queue, kernel, (8,), (1,))
    result = np.empty_like(values)
    cl.enqueue_copy(device.queue, result, buffer)
    return bool(np.array_equal(result, 3 * values))


@pytest.mark.parametrize("isolated", [False, True])
@pytest.mark.parametrize("warm", [[], [_WARM]])
def test_built_then_found(device: Device, empty_cache: Path, isolated: bool, warm: list[Warm]) -> None:
    first = build(device, _TRIPLE, flags=_FLAGS, warm=warm, isolated=isolated)
    assert not first.cached
    assert _triples(first)
    for found in ("in memory", "on the disk"):
        if found == "on the disk":
            device.loaded.clear()
        second = build(device, _TRIPLE, flags=_FLAGS, warm=warm, isolated=isolated)
        assert second.cached
        assert _triples(second)
        assert second.build_ms >= 0


def test_a_program_in_memory_needs_no_disk(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = _TRIPLE + "// as long as the program of a scene\n" * 6000
    first = build(device, text, flags=_FLAGS, warm=[_WARM], isolated=False)

    for name in ("load_blob", "store_blob"):
        monkeypatch.setattr(cache, name, raising(AssertionError("the disk or the compiler was asked")))
    for name in ("compile_source", "load_kept"):
        monkeypatch.setattr(compiler, name, raising(AssertionError("the disk or the compiler was asked")))
    again = [build(device, text, flags=_FLAGS, warm=[_WARM]) for _ in range(20)]
    assert all(each.cached and each.cl_program is first.cl_program for each in again)
    assert statistics.median(each.build_ms for each in again) < 1


def test_programs_in_memory_are_the_devices_own(device: Device, empty_cache: Path) -> None:
    first = build(device, _TRIPLE, flags=_FLAGS, isolated=False)
    other = Device(device.info, device.cl_device)
    assert build(other, _TRIPLE, flags=_FLAGS, isolated=False).cl_program is not first.cl_program
    assert build(device, _TRIPLE, flags=_FLAGS, isolated=False).cl_program is first.cl_program


def test_the_program_used_longest_ago_is_forgotten() -> None:
    loaded = LoadedPrograms()
    for number in range(MOST):
        loaded.keep(str(number), number)
    assert loaded.get("0") == 0
    loaded.keep("more", MOST)
    assert loaded.get("1") is None
    assert [loaded.get(key) for key in ("0", "2", "more")] == [0, 2, MOST]
    loaded.clear()
    assert loaded.get("0") is None


def test_a_first_launch_makes_machine_code_once(device: Device, empty_cache: Path) -> None:
    """PoCL generates it for a local size, in files of its own; other drivers have it from the start, in the binary."""
    text = f"__constant long unique = {time.time_ns()};\n" + _TRIPLE
    program = build(device, text, flags=_FLAGS, warm=[_WARM])
    (entry,) = empty_cache.rglob("*.bin")
    if is_pocl(device.info):
        payload = cache.load_blob(entry.stem)
        assert payload is not None
        (code,) = (name for name, _ in driver_files.contents(payload) if name.endswith("triple.so"))
        assert Path(code).parent.name.startswith("1-1-1")
        # This process has the files of the child, and makes none itself.
        assert (drivers_folder.path() / code).exists()
    else:
        assert len(compiler.binary_of(program.cl_program)) > 0
    assert _triples(program)


def test_a_kept_program_is_loaded_without_a_compiler(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """PoCL's compiler reads the text and all headers of its own only to find out that it knows them."""
    text = f"__constant long unique = {time.time_ns()};\n" + _TRIPLE
    build(device, text, flags=_FLAGS, warm=[_WARM], isolated=False)
    device.loaded.clear()
    monkeypatch.setattr(compiler, "compile_source", raising(AssertionError("the compiler was asked")))
    monkeypatch.setattr(isolate, "run", raising(AssertionError("a process was started")))
    program = build(device, text, flags=_FLAGS, warm=[_WARM])
    assert program.cached
    # What stood in for machine code for any size of work-group is not there for a launch to find.
    assert not list(drivers_folder.path().glob("??/*/triple/0-0-0"))
    assert _triples(program)


def test_a_driver_without_a_cache_gives_binaries(
    device: Device, empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("POCL_KERNEL_CACHE", "0")
    first = build(device, _TRIPLE, flags=_FLAGS, warm=[_WARM], isolated=False)
    binary = compiler.binary_of(first.cl_program)
    assert len(binary) > 500  # NVIDIA's is text for a next compiler
    assert compiler.load_kept(device, binary, "not OpenCL", _FLAGS) is not None
    device.loaded.clear()
    assert _triples(build(device, _TRIPLE, flags=_FLAGS, warm=[_WARM], isolated=False))


def test_text_flags_and_launch_are_the_key(device: Device, empty_cache: Path) -> None:
    def cached(text: str = _TRIPLE, flags: Sequence[str] = _FLAGS, warm: Sequence[Warm] = ()) -> bool:
        return build(device, text, flags=flags, warm=warm, isolated=False).cached

    assert [cached(), cached()] == [False, True]
    assert [cached(_TRIPLE + "\n"), cached(_TRIPLE + "\n")] == [False, True]
    assert [cached(flags=[*_FLAGS, "-DX"]), cached(flags=[*_FLAGS, "-DX"])] == [False, True]
    assert [cached(warm=[_WARM]), cached(warm=[_WARM])] == [False, True]
    other_values = Warm(
        "triple", (16,), (1,), (Argument("buffer", 64), Argument("scalar", 0, "float32", 9.0))
    )
    assert cached(warm=[other_values]), "the values of a first launch do not change the machine code"


def test_another_driver_or_device_has_its_own_programs(device: Device, empty_cache: Path) -> None:
    """What one driver made is never given to another one: it may not even refuse it."""
    assert not build(device, _TRIPLE, flags=_FLAGS, isolated=False).cached
    infos = (
        dataclasses.replace(device.info, driver="99.9"),
        dataclasses.replace(device.info, name="Another processor"),
    )
    for info in infos:
        other = Device(info, device.cl_device)
        assert not build(other, _TRIPLE, flags=_FLAGS, isolated=False).cached
    again = Device(device.info, device.cl_device)
    assert build(again, _TRIPLE, flags=_FLAGS, isolated=False).cached


@pytest.mark.parametrize("aborts", [1, 2])
def test_a_compiler_that_crashes_is_tried_once_more(
    device: Device, empty_cache: Path, aborts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, tried = isolate.run, []

    def crashing(job: str, *arguments: Any, **settings: Any) -> Any:
        tried.append(job)
        if len(tried) <= aborts:
            raise isolate.DriverAbortedError("the driver aborted (signal 6) while building a program")
        return run(job, *arguments, **settings)

    monkeypatch.setattr(isolate, "run", crashing)
    if aborts == 1:
        assert _triples(build(device, _TRIPLE, flags=_FLAGS))
    else:
        with pytest.raises(isolate.DriverAbortedError, match="signal 6"):
            build(device, _TRIPLE, flags=_FLAGS)
    assert len(tried) == 2


@pytest.mark.parametrize("damage", [b"", b"nonsense"])
def test_a_binary_that_the_driver_refuses_is_built_again(
    device: Device, empty_cache: Path, damage: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    build(device, _TRIPLE, flags=_FLAGS, isolated=False)
    (entry,) = empty_cache.rglob("*.bin")
    entry.write_bytes(damage)
    device.loaded.clear()
    again = build(device, _TRIPLE, flags=_FLAGS, isolated=False)
    assert not again.cached
    assert _triples(again)
    device.loaded.clear()
    monkeypatch.setattr(compiler, "load_kept", lambda *_: None)
    assert _triples(build(device, _TRIPLE, flags=_FLAGS, isolated=False))


@pytest.mark.parametrize("isolated", [False, True])
def test_a_build_failure_knows_our_file_and_line(
    device: Device, empty_cache: Path, tmp_path: Path, isolated: bool, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "entry.cl").write_text(
        '#include "part.h"\n__kernel void k(__global float *a) { a[0] = f(); }\n'
    )
    (tmp_path / "part.h").write_text("// a comment\nfloat f() {\n    return undeclared;\n}\n")
    flat = flatten("entry.cl", kernels=tmp_path)
    with pytest.raises(KernelBuildError, match="undeclared") as caught:
        build(device, flat.text, flags=_FLAGS, sources=flat.sources, isolated=isolated)
    assert str(caught.value).startswith("kernels/part.h:3:12: the kernel does not build on ")
    assert (
        "    2 | float f() {\n    3 |     return undeclared;\n      |            ^\n    4 | }"
        in caught.value.details
    )
    assert caught.value.status == 3
    if isolated:
        assert capfd.readouterr().err == "", "what the driver prints is for the details only"
    assert not list(empty_cache.rglob("*.bin"))


def test_a_faulty_formula_is_the_users(device: Device, empty_cache: Path) -> None:
    flat = flatten(
        "entry",
        generated={"entry": '#include "formula.h"', "formula.h": "float f() { return y; }"},
        user=["formula.h"],
    )
    assert str(
        failure(
            KernelBuildError,
            build,
            device,
            flat.text,
            flags=_FLAGS,
            sources=flat.sources,
            isolated=False,
        )
    ).startswith("generated/formula.h:1:20: ")


def test_a_kernel_that_is_not_there(device: Device, empty_cache: Path) -> None:
    program = build(device, _TRIPLE, flags=_FLAGS, isolated=False)
    with pytest.raises(DeviceError, match="making the kernel quadruple") as caught:
        program.kernel("quadruple")
    assert caught.value.status == 3


def test_a_recipe_survives_the_way_to_the_child(device: Device, empty_cache: Path) -> None:
    recipe = Warm(
        "k",
        (4, 2),
        None,
        (Argument("buffer", 64), Argument("bytes", dtype="0000803f02000000"), Argument("local", 16)),
    )
    assert Warm.from_data(recipe.as_data()) == recipe
    text = (
        "typedef struct { float a; int b; } pair;\n"
        "__kernel void k(__global float *out, pair p, __local float *scratch) {\n"
        "    scratch[0] = p.a;\n    out[get_global_id(0)] = scratch[0] * p.b;\n}\n"
    )
    assert not build(device, text, flags=_FLAGS, warm=[recipe]).cached


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_no_flag_assumes_finite_numbers(device: Device, empty_cache: Path, precision: str) -> None:
    flags = math_flags("float64" if precision == "float64" else "float32")
    assert "-cl-fast-relaxed-math" not in flags
    assert "-cl-finite-math-only" not in flags
    assert "-cl-unsafe-math-optimizations" not in flags
    text = (
        "__kernel void k(__global int *out, float zero) {\n"
        "    const float huge = 1.0f / zero, none = zero / zero;\n"
        "    out[0] = isinf(huge); out[1] = isnan(none); out[2] = none != none; out[3] = huge > 3e38f;\n}\n"
    )
    kernel = build(device, text, flags=flags, isolated=False).kernel("k")
    out = device.buffer(16, "answers")
    kernel.set_args(out, np.float32(0))
    cl.enqueue_nd_range_kernel(device.queue, kernel, (1,), (1,))
    answers = np.empty(4, np.int32)
    cl.enqueue_copy(device.queue, answers, out)
    assert answers.tolist() == [1, 1, 1, 1]
