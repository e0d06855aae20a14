"""The options of a render on the command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

PARTIAL = ".partial"
"""Suffix of the file for unfinished work, added to the first output's name."""


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
