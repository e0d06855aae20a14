"""What is installed: the program's version, kernels, scenes and the formula library."""

from __future__ import annotations

from pathlib import Path

__version__ = "0.1.0"

PACKAGE = Path(__file__).resolve().parents[1]


def folder(name: str) -> Path:
    """The folder `kernels`, `scenes` or `formulas/library`.

    In an installed wheel they lie inside the package; in a checkout `kernels` and `scenes` lie beside it.

    Raises:
        FileNotFoundError: the installation is incomplete.
    """
    for root in (PACKAGE, PACKAGE.parent):
        candidate = root / name
        if candidate.is_dir():
            return candidate
    raise FileNotFoundError(f"the installation lacks its folder {name!r}")
