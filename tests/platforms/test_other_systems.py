"""What other systems lack or have, as far as it can be tried on this one."""

from __future__ import annotations

import pkgutil
import re
from pathlib import Path

import clfractal
from clfractal.device import bundled
from clfractal.device.advice import install_hint
from clfractal.files.document import read_document
from tests.shell import SCENE, python, works

# Modules and calls that Windows has not, hidden before the package is imported. (NumPy, pyopencl and Python's own
# parts were built for this system, so they come first.)
HIDE = """
import subprocess, tempfile, ctypes, multiprocessing, concurrent.futures, asyncio, logging, urllib.request
import numpy, pyopencl, pydantic, yaml, psutil, typer, rich, platformdirs, OpenEXR, PIL.Image, png, cmap
import os, sys, signal, builtins
flock = __import__("fcntl").flock, __import__("fcntl").LOCK_EX | __import__("fcntl").LOCK_NB
for name in ("fcntl", "resource", "termios", "pwd", "grp"):
    sys.modules[name] = None
for name in ("pread", "pwritev", "fchmod", "fdatasync", "memfd_create", "set_blocking", "sysconf",
             "O_CLOEXEC", "O_NONBLOCK", "getuid", "geteuid", "register_at_fork", "fork"):
    if hasattr(os, name):
        delattr(os, name)
class msvcrt:
    LK_NBLCK = 2
    @staticmethod
    def locking(descriptor, how, count):
        try:
            flock[0](descriptor, flock[1])
        except BlockingIOError as error:
            raise PermissionError(13, "Permission denied") from error
sys.modules["msvcrt"] = msvcrt
"""
WINDOWS_FILES = """
sys.platform = "win32"
import clfractal.files.system, clfractal.files.memory
clfractal.files.system.RENAMES_OPEN_FILES = False
assert clfractal.files.system.msvcrt is msvcrt
sys.platform = "linux"
"""


def run(text: str, folder: Path) -> str:
    """The output of Python text in a process where nothing of POSIX alone is left."""
    return works(python(HIDE + WINDOWS_FILES + text, folder=folder)).out


def test_every_module_is_imported_without_posix(tmp_path: Path) -> None:
    packages = pkgutil.walk_packages(clfractal.__path__, "clfractal.")
    # What runs on a cluster's workers needs their library.
    left_out = r"\.(viewer|__main__|cluster\.tasks)\b"
    names = [each.name for each in packages if not re.search(left_out, each.name)]
    assert len(names) > 100
    text = (
        "import importlib\nfor name in " + repr(names) + ":\n    importlib.import_module(name)\nprint('all')"
    )
    assert run(text, tmp_path) == "all\n"


def test_a_picture_is_rendered_written_and_resumed_without_posix(tmp_path: Path) -> None:
    """With an empty child pool: what has to be compiled goes through it."""
    (tmp_path / "scène.yaml").write_bytes(("\ufeff" + SCENE.replace("\n", "\r\n")).encode())
    text = """
import numpy as np
from clfractal.cli.shell import Shell
from clfractal.cli import run
from clfractal.files import system
from clfractal.files.journal import Journal
from clfractal.errors import FileError
shell = Shell(owns_process=False)
assert run(["render", "scène.yaml", "-o", "bild ü.png", "-o", "a.exr", "--size", "64x36"], shell) == 0
assert run(["render", "bild ü.png", "-o", "b.exr"], shell) == 0
first = Journal.create("a.partial", {"a": 1}, ("R",), 4)
first.append(2, np.full((1, 32, 32), 0.5, np.float32))
try:
    Journal.resume("a.partial", {"a": 1}, ("R",), 4)
except FileError as error:
    assert "in use" in str(error), error
else:
    raise AssertionError("the journal is not locked")
first.close()
again = Journal.resume("a.partial", {"a": 1}, ("R",), 4)
assert again.done.tolist() == [False, False, True, False]
assert (again.tile(2) == 0.5).all()
again.discard()
from clfractal.files import memory
assert memory.available() > 0
print("done")
"""
    assert run(text, tmp_path).endswith("done\n")
    assert {path.name for path in tmp_path.iterdir()} == {"scène.yaml", "bild ü.png", "a.exr", "b.exr"}


def test_line_ends_and_a_mark_of_windows() -> None:
    plain = read_document(SCENE, "a.yaml")
    assert (
        read_document("\ufeff".encode().decode("utf-8-sig") + SCENE.replace("\n", "\r\n"), "a.yaml") == plain
    )


def test_the_messages_name_what_to_install_there() -> None:
    for system, machine, told in (
        ("Linux", "x86_64", "pip install pocl-binary-distribution"),
        ("Linux", "aarch64", "apt install pocl-opencl-icd"),
        ("Windows", "AMD64", "pip install intel-opencl-rt"),
        ("Windows", "ARM64", "Compatibility Pack"),
        ("Darwin", "arm64", "conda-forge"),
        ("FreeBSD", "amd64", "PoCL"),
    ):
        line = install_hint(system, machine)
        assert line.startswith("no OpenCL device; ")
        assert told in line


def test_intels_driver_is_named_to_the_loader_on_windows(tmp_path: Path) -> None:
    driver = tmp_path / "Library" / "bin" / "intelocl64.dll"
    environment = {"PATH": "C:\\Windows", "OCL_ICD_FILENAMES": "other.dll"}
    bundled.offer(environment, str(tmp_path), "win32")
    assert environment["OCL_ICD_FILENAMES"] == "other.dll", "not installed"
    driver.parent.mkdir(parents=True)
    driver.touch()
    for _ in range(2):
        bundled.offer(environment, str(tmp_path), "win32")
        assert environment["OCL_ICD_FILENAMES"] == f"other.dll;{driver}"
        assert environment["PATH"] == f"{driver.parent};C:\\Windows"
    untouched: dict[str, str] = {}
    bundled.offer(untouched, str(tmp_path), "linux")
    assert not untouched
