"""What the command line asks of the window."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Options:
    """The options of `clfractal view`; see `cli/list_window.py` for their meanings."""

    scene: str | None = None
    device: str | None = None
    size: tuple[int, int] | None = None
    fullscreen: bool = False
    monitors: str | None = None
    windows: bool = False
    stereo: str | None = None
    overrides: tuple[str, ...] = ()
    shot: Path | None = None
    save: Path | None = None
    record: Path | None = None
    play: Path | None = None
    panels: bool = True
    share: bool = True
    seconds: float | None = None
