"""What other systems lack or have, as far as it can be tried on this one; what `pip install` finds for them."""

from __future__ import annotations

import importlib.metadata
import pkgutil
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import clfractal
from clfractal.device import bundled
from clfractal.device.advice import install_hint
from clfractal.files.document import read_document
from tests.platforms.systems import BUILT, LOCKS, PROJECT, SYSTEMS, System
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


# --- `pip install` works on the four systems ---


BY_NAME = pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: system.name)
# Drivers that come along, where they have wheels.
DRIVERS = {"linux-x86_64": "pocl-binary-distribution", "windows-x64": "intel-opencl-rt"}


def locked(system: System) -> dict[str, str]:
    lines = (LOCKS / f"{system.name}.txt").read_text(encoding="utf-8").splitlines()
    pairs = [line.split("==") for line in lines if line and not line.startswith("#")]
    return {canonicalize_name(name): version for name, version in pairs}


def asked() -> Iterator[Requirement]:
    """All requirements of the project, of its extras too."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    yield from map(Requirement, project["dependencies"])
    for extra, group in project["optional-dependencies"].items():
        if extra not in BUILT:
            yield from map(Requirement, group)


def holds(requirement: Requirement, system: System, extra: str = "") -> bool:
    return requirement.marker is None or requirement.marker.evaluate({**system.markers, "extra": extra})


@BY_NAME
def test_every_requirement_has_a_version_that_fits(system: System) -> None:
    """A requirement that was added or raised without `make locks` fails here."""
    versions = locked(system)
    for requirement in asked():
        if holds(requirement, system):
            name = canonicalize_name(requirement.name)
            assert name in versions, f"{requirement}: run `make locks`"
            assert requirement.specifier.contains(versions[name]), f"{requirement}: run `make locks`"


@BY_NAME
def test_what_these_ask_for_is_there_too(system: System) -> None:
    """As far as they are installed here: a package that one asks for on that system alone is in its list."""
    versions = locked(system)
    looked_at = 0
    for name, version in versions.items():
        try:
            found = importlib.metadata.distribution(name)
        except importlib.metadata.PackageNotFoundError:
            continue
        if found.version != version:
            continue
        looked_at += 1
        for line in found.requires or ():
            requirement = Requirement(line)
            if holds(requirement, system):
                assert canonicalize_name(requirement.name) in versions, f"{name} asks for {line}"
    assert looked_at >= 5


@BY_NAME
def test_a_driver_comes_along_where_it_has_a_wheel(system: System) -> None:
    """pyopencl's extra `pocl` asks for one everywhere, and then nothing can be installed."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    needed = {Requirement(line).name for line in project["dependencies"] if holds(Requirement(line), system)}
    drivers = needed & set(DRIVERS.values())
    assert drivers == ({DRIVERS[system.name]} if system.name in DRIVERS else set())
    # Wherever it would have none, it is not in the list: neither by itself nor by the extra `intel`.
    elsewhere = set(DRIVERS.values()) - {DRIVERS.get(system.name), "intel-opencl-rt"}
    assert not elsewhere & set(locked(system))
    assert ("intel-opencl-rt" in locked(system)) == (system.name in DRIVERS)


def test_the_classifiers_tell_the_truth() -> None:
    """A system is named once somebody has rendered on it (docs/platforms.md)."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    told = {line for line in project["classifiers"] if line.startswith("Operating System")}
    assert told == {"Operating System :: POSIX :: Linux"}
    page = (PROJECT.parent / "docs" / "platforms.md").read_text(encoding="utf-8")
    assert "Windows and macOS, with any device" in page.split("## What was never tried")[1]
