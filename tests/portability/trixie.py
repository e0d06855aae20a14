"""A Debian 13 in a folder, for OpenCL implementations newer than the system's: PoCL 6 and Mesa's rusticl, with Python 3.13.

Only root can make and enter it. Nothing stays mounted: each process runs in a mount namespace of its own.
"""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import clfractal

RELEASE = "trixie"
PYTHON = "3.13"
_INCLUDED = "python3,pocl-opencl-icd,mesa-opencl-icd,libgl1"
# What the tests marked `conformance`, and the modules that pytest reads to find them, import.
_PACKAGES = (
    *(
        "numpy",
        "pyopencl",
        "OpenEXR",
        "PyYAML",
        "pydantic",
        "typer",
        "rich",
        "Pillow",
        "pypng",
        "cmap",
        "platformdirs",
    ),
    *("pytest", "pytest-timeout", "pytest-xdist", "hypothesis", "mpmath", "psutil", "packaging"),
)
# Another list of packages, another folder: the system outlives the checkout that made it.
_SITE = f"opt/packages-{hashlib.sha256(' '.join(_PACKAGES).encode()).hexdigest()[:8]}"


class RefusedError(Exception):
    """This user or this machine cannot have one."""


def folder(workplace: Path) -> Path:
    """Where it lies: in the folder that CLFRACTAL_TRIXIE names, which many checkouts may share, else in the workplace."""
    return Path(os.environ.get("CLFRACTAL_TRIXIE") or workplace / RELEASE).resolve()


def prepare(root: Path, program: Path) -> None:
    """Makes what is not there yet: some 50 s for the system, 20 s for Python's packages, 1.8 GB.

    Args:
        root: of the Debian, which many checkouts may share, at the same time too.
        program: a folder of the checkout, for a copy of the installed program.

    Raises:
        RefusedError: no root, no apt, no permission to mount, or something cannot be fetched.
    """
    if not hasattr(os, "geteuid") or os.geteuid() != 0 or shutil.which("apt-get") is None:
        raise RefusedError("only root can make a Debian in a folder, where apt-get is")
    _run(["unshare", "--mount", "true"])
    if not (root / "usr").exists():
        if shutil.which("debootstrap") is None:
            _run(["apt-get", "update", "-qq"])
            _run(["apt-get", "install", "-y", "-qq", "--no-install-recommends", "debootstrap"])
        beside = root.with_name(f"{root.name}.new")
        shutil.rmtree(beside, ignore_errors=True)
        beside.parent.mkdir(parents=True, exist_ok=True)
        _run(["debootstrap", "--variant=minbase", f"--include={_INCLUDED}", RELEASE, str(beside), _source()])
        beside.rename(root)
    site = root / _SITE
    if not site.exists():
        # From outside, where pip is set up: inside is no pip, and no network.
        beside = site.with_name("packages.new")
        shutil.rmtree(beside, ignore_errors=True)
        tags = [f"--platform=manylinux_2_{minor}_x86_64" for minor in (28, 27, 17)]
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--target", str(beside), *tags]
        command += ["--platform=manylinux2014_x86_64", f"--python-version={PYTHON}", "--only-binary=:all:"]
        _run([*command, *_PACKAGES])
        beside.rename(site)
    package = program / "clfractal"
    shutil.rmtree(package, ignore_errors=True)
    shutil.copytree(Path(clfractal.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("kernels", "scenes"):  # in a checkout they stand beside the package
        beside = Path(clfractal.__file__).parents[1] / name
        if not (package / name).exists() and beside.is_dir():
            shutil.copytree(beside, package / name)


def command(
    root: Path, program: Path, checkout: Path, module: Sequence[str], environment: Mapping[str, str]
) -> list[str]:
    """The command that runs `python3 -m MODULE...` inside; the checkout is seen there at the same path."""
    place = shlex.quote(f"{root}{checkout}")
    mounts = " && ".join(
        [
            f"mkdir -p {place}",
            f"mount --bind {shlex.quote(str(checkout))} {place}",
            *(f"mount --rbind /{name} {shlex.quote(f'{root}/{name}')}" for name in ("proc", "sys", "dev")),
        ]
    )
    passed = {
        name: value
        for name, value in environment.items()
        if name.startswith(("CLFRACTAL_", "POCL_", "OCL_", "RUSTICL_"))
    }
    passed |= {
        "PATH": "/usr/bin:/bin",
        "HOME": "/root",
        "LANG": "C.UTF-8",
        # The tests come last: the program is the installed one.
        "PYTHONPATH": f"{program}:/{_SITE}:{checkout}",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    inside = ["env", "-i", *(f"{name}={value}" for name, value in passed.items())]
    inside += ["sh", "-c", f'cd {shlex.quote(str(checkout))} && exec python3 -P -m "$@"', "sh", *module]
    entered = f"{mounts} && exec chroot {shlex.quote(str(root))} {shlex.join(inside)}"
    return ["unshare", "--mount", "--propagation=private", "sh", "-c", entered]


def _source() -> str:
    """Where apt gets Debian from."""
    told = subprocess.run(
        ["apt-get", "indextargets", "--format", "$(ORIGIN) $(COMPONENT) $(SITE)", "Created-By: Packages"],
        capture_output=True,
        text=True,
        check=False,
    )
    for line in told.stdout.splitlines():
        origin, component, site = line.split(maxsplit=2)
        if (origin, component) == ("Debian", "main") and "security" not in site:
            return site
    return "http://deb.debian.org/debian"


def _run(command: list[str]) -> None:
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RefusedError(f"{shlex.join(command)[:300]} failed:\n{done.stdout[-1500:]}{done.stderr[-1500:]}")
