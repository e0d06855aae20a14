"""Clang, of which most OpenCL compilers of GPUs are made: found on this machine, and called."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from clfractal.device.program import math_flags
from clfractal.device.structs import Precision

# What OpenCL 1.2 has without asking; float64 is not among it.
_EXTENSIONS = (
    "-all",
    "+cl_khr_byte_addressable_store",
    "+cl_khr_global_int32_base_atomics",
    "+cl_khr_global_int32_extended_atomics",
    "+cl_khr_local_int32_base_atomics",
    "+cl_khr_local_int32_extended_atomics",
)
_BUILT_INS = ("-Xclang", "-finclude-default-header", "-Xclang", "-fdeclare-opencl-builtins")


def found() -> list[str]:
    """The names of all clang programs on the PATH, the newest first; the one without a number counts as the newest."""
    numbers = {
        path.name: path.name.partition("-")[2]
        for place in os.get_exec_path()
        for path in Path(place).glob("clang*")
        if re.fullmatch(r"clang(-\d+)?", path.name) and shutil.which(path.name)
    }
    return sorted(numbers, key=lambda name: int(numbers[name] or 1000), reverse=True)


def call(program: str, text: str, *options: str, declared: bool = True) -> tuple[str, str]:
    """What clang makes of an OpenCL text: its standard output, and its messages; a status that is not 0 is a message, too.

    `declared`: the text may use OpenCL's own functions and types; without them the preprocessor shows nothing but the text.
    """
    command = [
        program,
        "-x",
        "cl",
        "-o",
        "-",
        *options,
        *(_BUILT_INS if declared else ("-cl-no-stdinc",)),
        "-",
    ]
    ended = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    failed = f"status {ended.returncode}" if ended.returncode else ""
    return ended.stdout, ended.stderr.strip() or failed


def language(precision: Precision) -> Sequence[str]:
    """OpenCL C 1.2 with the program's own flags, and with no extension but those that every device has (and float64)."""
    extensions = (*_EXTENSIONS, *(["+cl_khr_fp64"] if precision == "float64" else []))
    return (*math_flags(precision), "-Xclang", f"-cl-ext={','.join(extensions)}")


# How machine code of AMD's and of NVIDIA's GPUs calls.
_CALLED = re.compile(r"(\w+)@(?:got)?(?:pc)?rel32@lo|\bcall\.uni\s*(?:\([^)]*\)\s*,)?\s*(\w+)\s*,")


def called(code: str) -> set[str]:
    """The functions that a GPU's machine code calls."""
    return {one or other for one, other in _CALLED.findall(code)}
