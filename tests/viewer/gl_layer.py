"""Builds the OpenCL layer of gl_layer.c, which lets PoCL share textures with OpenGL, and says how it is loaded."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

SOURCE = Path(__file__).with_name("gl_layer.c")
_HEADER = Path("/usr/include/CL/cl_layer.h")


def missing() -> str:
    """What building it would need, in one line; empty if nothing is missing."""
    if shutil.which("cc") is None:
        return "no C compiler"
    if not _HEADER.exists():
        return "no OpenCL headers (Debian: opencl-headers)"
    return ""


def build(folder: Path) -> Path:
    """Compiles it into a folder; the library."""
    library = folder / "libgl_layer.so"
    command = [
        "cc",
        "-O1",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-shared",
        "-fPIC",
        "-o",
        str(library),
        str(SOURCE),
    ]
    subprocess.run([*command, "-ldl", "-lpthread"], check=True)
    return library


def environment(
    library: Path, log: Path, *, drives: str = "", answer: str = "", events: bool = False
) -> Mapping[str, str]:
    """Environment variables for a process that shall have it.

    Args:
        library: from `build`.
        log: where it writes what is done wrong, one line for each mistake; the file is made with the first.
        drives: a part of the platform's version text: whose devices draw for OpenGL; all if empty.
        answer: how the driver names them: as the current one (empty), "list", "none" or "missing".
        events: whether fences of OpenGL can be waited for.
    """
    chosen = {"GL_LAYER_DEVICE": drives, "GL_LAYER_ANSWER": answer, "GL_LAYER_EVENTS": "1" if events else ""}
    return {
        "OPENCL_LAYERS": str(library),
        "GL_LAYER_LOG": str(log),
        **{name: value for name, value in chosen.items() if value},
    }
