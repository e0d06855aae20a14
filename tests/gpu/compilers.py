"""Compilers of GPUs that need no GPU: clang with libclc for both makers, and NVIDIA's ptxas behind it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from clfractal.device.structs import Precision
from tests.gpu import limits
from tests.gpu.figures import GPUS, Figures, Gpu, Maker, of_amd, of_ptxas
from tests.platforms import clang

CLANG = "clang-16"
LIBRARIES = Path("/usr/lib/clc")
PTXAS_PACKAGE = "nvidia-cuda-nvcc-cu12"
DEBIAN = "apt-get install clang-16 libclc-16"

_LIBRARY: dict[Maker, str] = {"NVIDIA": "nvptx64--nvidiacl.bc", "AMD": "amdgcn--amdhsa.bc"}
# OpenCL allows divisions and roots that are right to 2.5 and 3 units in the last place (1.2, table 7.1). NVIDIA's own
# compiler makes use of it, and clang for it where it is told; AMD's code generator always. PTX 7.8 is the newest that this
# clang writes and the first with sm_90, and every ptxas since CUDA 11.8 knows it.
_NVIDIA = (
    "--target=nvptx64-nvidia-nvcl",
    *("-Xclang", "-target-cpu", "-Xclang", "sm_75", "-Xclang", "-target-feature", "-Xclang", "+ptx78"),
    *("-mllvm", "-nvptx-prec-divf32=1", "-mllvm", "-nvptx-prec-sqrtf32=0"),
)
_AMD = ("--target=amdgcn-amd-amdhsa", "-nogpulib")
# libclc names its targets in another way, and not every program calls something of it.
_QUIET = ("-Wno-linker-warnings", "-Wno-unused-command-line-argument", "-Wno-unused")
# libclc has no functions for images, so a program with images cannot be linked.
_OF_IMAGES = re.compile(r"_Z\d+(?:read|write)_image\w*")
_MESSAGE = 600  # characters of a compiler's message that are shown


class MissingCompilerError(Exception):
    """A compiler is not there; the message says what to install."""


class RejectedError(Exception):
    """A program does not compile, or breaks a limit; the message says why."""


@dataclass(frozen=True, slots=True)
class Compilers:
    """The programs, and their versions: figures depend on both."""

    clang: str
    ptxas: str
    libraries: Path
    versions: dict[str, str]


def find() -> Compilers:
    """The compilers of this machine.

    Raises:
        MissingCompilerError: one is not there.
    """
    front, back = shutil.which(CLANG), _ptxas()
    missing = [
        *(
            [DEBIAN]
            if front is None or not all((LIBRARIES / name).exists() for name in _LIBRARY.values())
            else []
        ),
        *([f"pip install {PTXAS_PACKAGE}"] if back is None else []),
    ]
    if front is None or back is None or missing:
        raise MissingCompilerError(f"compilers for GPUs are missing: {'; '.join(missing)}")
    versions = {
        "clang": _version(front, r"version (\d+\.\d+\.\d+)"),
        "ptxas": _version(back, r"V(\d+\.\d+\.\d+)"),
    }
    return Compilers(front, back, LIBRARIES, versions)


def _ptxas() -> str | None:
    """The one of the package, of which this environment has one version for all; else any other."""
    try:
        files = metadata.files(PTXAS_PACKAGE) or []
    except metadata.PackageNotFoundError:
        return shutil.which("ptxas")
    return next((str(path.locate()) for path in files if path.name in ("ptxas", "ptxas.exe")), None)


def _version(program: str, pattern: str) -> str:
    said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    found = re.search(pattern, said)
    return found[1] if found else "unknown"


def shown(compilers: Compilers, text: str, precision: Precision) -> str:
    """What a compiler sees of a program: without comments, and macros put in. Two that look the same have the same figures.

    Raises:
        RejectedError: the text cannot be read.
    """
    return _made(compilers, text, precision, "-E", "-P", "-target", "spir64-unknown-unknown", declared=False)


def measured(compilers: Compilers, text: str, precision: Precision) -> dict[str, dict[str, Figures]]:
    """What each kernel of a program needs, by kernel and by GPU; nothing of a program with images, which cannot be linked.

    Raises:
        RejectedError: it does not compile for one of the GPUs, or is not for every device (see `limits`).
    """
    problems = list(limits.words(text, shown(compilers, text, precision)))
    result: dict[str, dict[str, Figures]] = {}
    # One text in NVIDIA's assembly serves both of its GPUs, as it does when a driver compiles what it has kept.
    ptx = _made(compilers, text, precision, *_NVIDIA, *_linked(compilers, "NVIDIA"))
    problems += limits.broken(ptx)
    for gpu in GPUS:
        code = ptx if gpu.maker == "NVIDIA" else _made(compilers, text, precision, *_for_amd(compilers, gpu))
        if _OF_IMAGES.search(code):
            continue
        for kernel, figures in _figures(compilers, code, gpu).items():
            result.setdefault(kernel, {})[gpu.name] = figures
    if problems:
        raise RejectedError("; ".join(problems))
    return result


def _linked(compilers: Compilers, maker: Maker) -> tuple[str, ...]:
    library = str(compilers.libraries / _LIBRARY[maker])
    return ("-O3", "-S", "-Xclang", "-mlink-builtin-bitcode", "-Xclang", library)


def _for_amd(compilers: Compilers, gpu: Gpu) -> tuple[str, ...]:
    return (*_AMD, f"-mcpu={gpu.name}", *_linked(compilers, "AMD"))


def _made(compilers: Compilers, text: str, precision: Precision, *options: str, declared: bool = True) -> str:
    made, said = clang.call(
        compilers.clang, text, *options, *clang.language(precision), *_QUIET, declared=declared
    )
    if said:
        raise RejectedError(said[:_MESSAGE])
    return made


def _figures(compilers: Compilers, code: str, gpu: Gpu) -> dict[str, Figures]:
    if gpu.maker == "NVIDIA":
        return of_ptxas(_assembled(compilers, code, gpu))
    foreign = {name for name in clang.called(code) if not re.search(rf"^{name}:", code, re.MULTILINE)}
    if foreign:
        raise RejectedError(f"{gpu.name}: calls what is nowhere: {', '.join(sorted(foreign))}")
    return of_amd(code)


def _assembled(compilers: Compilers, ptx: str, gpu: Gpu) -> str:
    """What ptxas says about the kernels of a program in NVIDIA's assembly."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "program.ptx"
        path.write_text(ptx, encoding="utf-8")
        command = [compilers.ptxas, "-v", "-O3", "-arch", gpu.name, "-o", os.devnull, str(path)]
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode:
        raise RejectedError(f"{gpu.name}: {(ended.stdout + ended.stderr).strip()[:_MESSAGE]}")
    return ended.stdout + ended.stderr
