"""Wheels that are built from a folder with sources, and what is in them."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def run(*command: str | Path, folder: Path) -> str:
    """Runs a command in a folder without anything that leads to the checkout; gives its standard output."""
    clean = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    ended = subprocess.run(list(map(str, command)), cwd=folder, env=clean, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr[-2000:]
    return ended.stdout


def built_wheel(source: Path, folder: Path) -> Path:
    """The wheel of a folder with sources, built in another folder."""
    run(
        *(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"),
        *("--wheel-dir", folder, source),
        folder=folder,
    )
    (found,) = folder.glob("*.whl")
    return found


def names_in(wheel: Path) -> set[str]:
    """The files in a wheel."""
    return set(zipfile.ZipFile(wheel).namelist())
