"""Pictures of the shell, to compare windows with."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from clfractal.cli import run
from clfractal.cli.shell import Shell
from tests.pictures import read_picture
from tests.shell import process
from tests.window.display import Pixels


def film(
    folder: Path,
    scene: str | Path,
    size: tuple[int, int],
    *options: str,
    extra: Mapping[str, str] | None = None,
) -> Pixels:
    """The shell's picture, shape (height, width, 3); `extra`: environment variables, which want a process of its own."""
    target = folder / "film.png"
    given = ["render", str(folder / scene), "--size", f"{size[0]}x{size[1]}", "-o", str(target), "--quiet"]
    given += ["--device", "pthread", *options]
    if extra is not None:
        assert process(given, folder, extra).status == 0
    else:
        assert run(given, Shell(owns_process=False)) == 0
    return read_picture(target)
