"""Drivers that come as Python packages, but that the loader of OpenCL does not find by itself."""

from __future__ import annotations

import os
import sys
from collections.abc import MutableMapping
from pathlib import Path

_LISTED = "OCL_ICD_FILENAMES"
# Where the wheel of Intel's CPU runtime has its driver on Windows, from the environment's folder.
_INTEL = Path("Library", "bin", "intelocl64.dll")


def offer(
    environment: MutableMapping[str, str] | None = None, prefix: str | None = None, system: str = sys.platform
) -> None:
    """Names Intel's CPU runtime to the loader, on Windows: its own way is an entry in the registry by an administrator.

    The loader in pyopencl's wheel reads OCL_ICD_FILENAMES, but not in a process with an administrator's rights. What the
    driver loads lies beside it, and is looked for along the PATH. Child processes inherit both; a second call does nothing.
    """
    if system != "win32":
        return
    known = os.environ if environment is None else environment
    driver = Path(prefix or sys.prefix) / _INTEL
    listed = [name for name in known.get(_LISTED, "").split(";") if name]
    if str(driver) in listed or not driver.is_file():
        return
    known[_LISTED] = ";".join([*listed, str(driver)])
    known["PATH"] = ";".join(filter(None, [str(driver.parent), known.get("PATH", "")]))
