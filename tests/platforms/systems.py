"""The systems that `pip install` has to work on, and what is recorded of them: `python -m tests.platforms.systems`.

For each system `locks/NAME.txt` has the versions that its dependencies resolve to, all extras included, with wheels alone
(but for `BUILT`). They are made with uv, which can resolve for another system than its own; the test needs no network.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

LOCKS = Path(__file__).resolve().parent / "locks"
PROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"
PYTHON = "3.11"
# For developers of the program, who can build what has no wheel.
BUILT = ("mutate",)


@dataclass(frozen=True, slots=True)
class System:
    """A system by the names that uv and the markers of requirements have for it."""

    name: str
    uv: str
    sys_platform: str
    platform_system: str
    platform_machine: str
    os_name: str = "posix"

    @property
    def markers(self) -> dict[str, str]:
        """What `packaging` evaluates a requirement's marker with."""
        return {
            "sys_platform": self.sys_platform,
            "platform_system": self.platform_system,
            "platform_machine": self.platform_machine,
            "os_name": self.os_name,
            "python_version": PYTHON,
            "python_full_version": f"{PYTHON}.0",
            "implementation_name": "cpython",
            "platform_python_implementation": "CPython",
            "platform_release": "",
            "platform_version": "",
            "implementation_version": f"{PYTHON}.0",
        }


SYSTEMS = (
    System("linux-x86_64", "x86_64-manylinux_2_28", "linux", "Linux", "x86_64"),
    System("linux-aarch64", "aarch64-manylinux_2_28", "linux", "Linux", "aarch64"),
    System("macos-arm64", "aarch64-apple-darwin", "darwin", "Darwin", "arm64"),
    System("windows-x64", "x86_64-pc-windows-msvc", "win32", "Windows", "AMD64", "nt"),
)


def record(system: System, uv: str = "uv") -> None:
    """Resolves anew, keeping versions that still fit.

    Raises:
        subprocess.CalledProcessError: something has no wheel for that system, or there is no network.
    """
    # Dear ImGui's wheels are for macOS 14 and later.
    environment = {**os.environ, "MACOSX_DEPLOYMENT_TARGET": "14.0"}
    command = [uv, "pip", "compile", "--quiet", "--no-header", "--no-annotate"]
    extras = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    command += [f"--extra={extra}" for extra in extras if extra not in BUILT]
    command += ["--only-binary", ":all:", "--python-version", PYTHON, "--python-platform", system.uv]
    command += ["--output-file", str(LOCKS / f"{system.name}.txt"), str(PROJECT)]
    subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=True)


def main() -> None:
    """Records all systems; the program uv may be named."""
    LOCKS.mkdir(exist_ok=True)
    for system in SYSTEMS:
        record(system, *sys.argv[1:2])
        print(system.name)


if __name__ == "__main__":
    main()
