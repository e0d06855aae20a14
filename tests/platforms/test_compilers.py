"""All programs are OpenCL C 1.2 for a device with no float64, and become machine code for GPUs: clang is asked, no device.

Drivers of processors take more than the language allows. Apple's compiler and those of GPUs, most of which are made of
clang, do not: they know no float64 unless the device has it, and no library of C.
"""

from __future__ import annotations

import os
import re
from functools import cache
from itertools import islice

import pytest

from clfractal.device.structs import Precision
from clfractal.files.resources import folder
from tests.platforms import clang
from tests.platforms.programs import EVERY_KIND, Named, every_text, of_formulas
from tests.variants import every, one_of

EXPECTED = "CLFRACTAL_EXPECT_CLANG"
"""Set to 1: a missing clang is a failure, not a reason to skip."""

PARTS = 4
"""So many tests share the programs of a GPU's maker: all at once take minutes."""

# A text has more functions than each program calls.
_WARNINGS = ("-Wall", "-Werror", "-Wno-unused", "-Wno-unused-command-line-argument")
NO_PROCESSOR = ("-fsyntax-only", "-target", "spir64-unknown-unknown")
# (For the first it takes a third of the time. `make gpu-check` makes code for both of what has changed.)
GPUS = {
    "NVIDIA": ("-S", "-target", "nvptx64-nvidia-nvcl", "-Xclang", "-target-cpu", "-Xclang", "sm_60"),
    "AMD": ("-S", "-target", "amdgcn-amd-amdhsa", "-mcpu=gfx1030", "-nogpulib"),
}
# How both name numbers of 64 bits in instructions that are not loads or stores of pairs.
_FLOAT64 = re.compile(r"\bv_\w*_f64\b|\b(?!ld|st|mov)[a-z]\w*(?:\.\w+)*\.f64\b")


@cache
def newest(*target: str) -> str:
    """The newest clang that has a target; skips, or fails where one is expected."""
    for program in clang.found():
        if not clang.call(program, "__kernel void k(void) {}\n", *target)[1]:
            return program
    missing = f"no clang for {target[2]} on this machine (Debian: clang)"
    if os.environ.get(EXPECTED) == "1":
        pytest.fail(missing)
    pytest.skip(missing)


def compiled(text: str, precision: Precision, target: tuple[str, ...]) -> str:
    warnings = (*_WARNINGS, *(["-Wdouble-promotion"] if precision == "float32" else []))
    made, said = clang.call(newest(*target), text, *target, "-O1", *clang.language(precision), *warnings)
    assert not said, said[:3000]
    return made


def checked(programs: list[Named], precision: Precision) -> None:
    for name, program in programs:
        try:
            compiled(program.text, precision, NO_PROCESSOR)
        except AssertionError as error:
            raise AssertionError(f"{name}: {error}") from None


@pytest.mark.parametrize(
    ("lanes", "precision"),
    every(
        5, [(4, "float32"), (1, "float32"), (16, "float32"), (4, "float64"), (16, "float64"), (1, "float64")]
    ),
)
def test_every_program_is_opencl_1_2(lanes: int, precision: Precision) -> None:
    checked(list(every_text(lanes, precision)), precision)


def test_every_formula_of_the_library_is_opencl_1_2() -> None:
    checked(list(of_formulas()), "float32")


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("maker", one_of(*GPUS))
def test_every_program_becomes_code_of_a_gpu(maker: str, part: int) -> None:
    """With numbers of 32 bits alone, and calls of nothing but its own functions and OpenCL's (whose names are mangled)."""
    for name, program in islice(every_text(1, "float32", EVERY_KIND), part, None, PARTS):
        code = compiled(program.text, "float32", GPUS[maker])
        assert not _FLOAT64.findall(code), name
        foreign = {
            each for each in clang.called(code) if not each.startswith("_Z") and each not in program.text
        }
        assert not foreign, name


def test_no_kernel_file_is_left_out() -> None:
    programs = [*every_text(1, "float32"), *of_formulas()]
    read = {name for _, program in programs for name in program.sources.texts}
    there = folder("kernels")
    assert {f"kernels/{path.relative_to(there).as_posix()}" for path in there.rglob("*.[ch]*")} <= read


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("__kernel void k(__global float *a) { double b = a[0]; a[0] = b; }", "double"),
        ("__kernel void k(__global float *a) { a[0] = a[0] * 0.1; }", "double precision constant"),
        (
            "__kernel void k(__global float *a) { a[0] = work_group_reduce_add(a[0]); }",
            "work_group_reduce_add",
        ),
        ("__kernel void k(__global float *a) { float *b = a; b[0] = 1.0f; }", "address space"),
    ],
)
def test_the_check_sees_what_1_2_has_not(text: str, told: str) -> None:
    with pytest.raises(AssertionError, match=told):
        compiled(text + "\n", "float32", NO_PROCESSOR)


def test_the_check_sees_float64_and_foreign_calls_in_machine_code() -> None:
    text = "void far(int); __kernel void k(__global double *a) { a[0] = a[0] * a[1]; far(1); }\n"
    for target in GPUS.values():
        code = compiled(text, "float64", target)
        assert _FLOAT64.findall(code)
        assert clang.called(code) == {"far"}
