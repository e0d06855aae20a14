"""What to install where there is no OpenCL device, on each system."""

from __future__ import annotations

import platform

_GPU = "or your GPU's driver"
_BY_SYSTEM = {
    ("Linux", "x86_64"): f"install a driver for the CPU with `pip install pocl-binary-distribution`, {_GPU}",
    ("Windows", "AMD64"): f"install a driver for the CPU with `pip install intel-opencl-rt`, {_GPU}",
    (
        "Linux",
        "",
    ): "install a driver for the CPU with `apt install pocl-opencl-icd` (Fedora: `dnf install pocl`, Arch: "
    f"`pacman -S pocl`), {_GPU}",
    (
        "Windows",
        "",
    ): "install Microsoft's OpenCL and OpenGL Compatibility Pack from its store, or your GPU's driver",
    (
        "Darwin",
        "",
    ): "macOS has an OpenCL of its own, but a virtual machine may show no device; PoCL is found by a pyopencl from "
    "conda-forge: `conda install -c conda-forge pyopencl pocl`",
}


def install_hint(system: str = "", machine: str = "") -> str:
    """`no OpenCL device; install ...`, for this system unless another is named as `platform` names it."""
    system, machine = system or platform.system(), machine or platform.machine()
    advice = _BY_SYSTEM.get((system, machine)) or _BY_SYSTEM.get((system, ""))
    return f"no OpenCL device; {advice or 'install PoCL, ' + _GPU}"
