"""Small pictures of one colour, and a program that is installed with some."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from clfractal.exchange import program_folder


def picture(path: Path, code: tuple[int, int, int] = (200, 100, 50), size: tuple[int, int] = (8, 4)) -> Path:
    """A picture of one colour."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", size, code).save(path)
    return path


def install(folder: Path, monkeypatch: pytest.MonkeyPatch, names: tuple[str, ...]) -> None:
    """Makes this folder that of the program, with pictures of these names and no formulas."""
    (folder / "formula").mkdir(parents=True)
    for name in names:
        picture(folder / "textures" / name)
    monkeypatch.setattr(program_folder, "PLACES", (str(folder),))
