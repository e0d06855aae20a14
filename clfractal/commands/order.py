"""What a render is asked for on the command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

PARTIAL = ".partial"
"""What is added to the first output's name for the file that keeps unfinished work."""


@dataclass(frozen=True, slots=True)
class Order:
    """The options of `clfractal render`, as they were given."""

    scene: str
    outputs: tuple[Path, ...] = ()
    device: str | None = None
    precision: str | None = None
    size: str | None = None
    overrides: tuple[str, ...] = ()
    region: str | None = None
    samples: int | None = None
    resume: bool = False
    stats: Path | None = None
