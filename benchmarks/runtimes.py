"""The OpenCL CPU runtimes of this machine, each alone in a folder that OCL_ICD_VENDORS can name."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

DEBIAN_FOLDER = Path("/etc/OpenCL/vendors")


@dataclass(frozen=True, slots=True)
class Runtime:
    """One OpenCL implementation: the folder of its loader entry, and of its libraries if need be."""

    name: str
    icd_folder: Path
    library_folder: Path | None = None

    def environment(self) -> dict[str, str | None]:
        """Changes to the environment under which this implementation is the first platform.

        The pyopencl wheel adds its own PoCL behind whatever the folder names, so the device is named too.
        """
        changes: dict[str, str | None] = {"OCL_ICD_VENDORS": str(self.icd_folder), "CLFRACTAL_DEVICE": "0:0"}
        changes |= dict.fromkeys(("OCL_ICD_FILENAMES", "PYOPENCL_CTX"))
        if self.library_folder:
            changes["LD_LIBRARY_PATH"] = str(self.library_folder)
        return changes


def parse_runtime(text: str) -> Runtime:
    """`NAME=ICD_FOLDER` or `NAME=ICD_FOLDER,LIBRARY_FOLDER`; ValueError says what is wrong."""
    name, equals, folders = text.partition("=")
    icd, _, library = folders.partition(",")
    if not (name and equals and icd):
        raise ValueError(f"a runtime looks like NAME=ICD_FOLDER[,LIBRARY_FOLDER], not {text!r}")
    for folder in filter(None, (icd, library)):
        if not Path(folder).is_dir():
            raise ValueError(f"{folder}: no such folder")
    return Runtime(name, Path(icd), Path(library) if library else None)


def find_runtimes(scratch: Path) -> list[Runtime]:
    """The pyopencl wheel's PoCL (what users have), the system's, Intel's; loader entries go to `scratch`."""
    found = []
    for number, (name, library) in enumerate(_libraries()):
        folder = scratch / f"runtime{number}"
        folder.mkdir(parents=True)
        (folder / "runtime.icd").write_text(f"{library}\n")
        inside = Path(library).parent
        found.append(Runtime(name, folder, inside if "intelocl" in library else None))
    return found


def _libraries() -> Iterator[tuple[str, str]]:
    """Names and libraries, as loader entries give them."""
    for package in ("pyopencl", "pocl_binary_distribution"):
        spec = importlib.util.find_spec(package)
        folders = spec.submodule_search_locations if spec and spec.submodule_search_locations else []
        for folder in folders:
            for library in sorted(Path(folder, ".libs").glob("libpocl*.so*")):
                yield "PoCL, PyPI wheel", str(library)
    for entry in sorted(DEBIAN_FOLDER.glob("*.icd")):
        label = "PoCL, system" if "pocl" in entry.name else f"{entry.stem}, system"
        yield label, entry.read_text().strip()
    intel = Path(sys.prefix, "lib", "libintelocl.so")
    if intel.exists():
        yield "Intel, PyPI", str(intel)
