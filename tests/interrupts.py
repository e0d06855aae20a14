"""Renders that are interrupted between two tiles, as Ctrl-C does it, and what their progress told."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.cli import render
from clfractal.cli.progress import Reporter
from clfractal.cli.shell import Shell
from clfractal.engine import drawing, run
from clfractal.engine.run import Progress
from clfractal.files.exr import read_exr


def watched(monkeypatch: pytest.MonkeyPatch, stop_at: int | None = None) -> list[tuple[int, int, int]]:
    """Tiles before, tiles done and all tiles, as renders of the shell tell them from now on; one tile to a launch.

    Args:
        stop_at: a KeyboardInterrupt comes as soon as so many tiles are done.
    """
    seen: list[tuple[int, int, int]] = []

    class Watched(Reporter):
        def __init__(self, shell: Shell, tiles: int) -> None:
            super().__init__(shell, tiles)
            self.all = tiles

        def __call__(self, state: Progress) -> None:
            assert state.tiles == self.all
            seen.append((state.tiles_before, state.tiles_done, state.tiles))
            super().__call__(state)
            if stop_at is not None and state.tiles_done >= stop_at:
                raise KeyboardInterrupt

    monkeypatch.setattr(render, "Reporter", Watched)
    monkeypatch.setattr(drawing, "CAPACITY", 1)
    return seen


def planes(path: Path) -> dict[str, bytes]:
    """The bytes of every channel."""
    return {name: np.ascontiguousarray(plane).tobytes() for name, plane in read_exr(path)[0].items()}


@contextmanager
def interrupted_at(number: int) -> Iterator[None]:
    """Ctrl-C before the numbered picture (a frame, a slice) that the shell would begin as the so-manieth."""
    begun, render = count(1), run.run

    def interrupted(*arguments: Any, **settings: Any) -> Any:
        if next(begun) == number:
            raise KeyboardInterrupt
        return render(*arguments, **settings)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("clfractal.cli.numbered.run", interrupted)
        with pytest.raises(KeyboardInterrupt):
            yield
