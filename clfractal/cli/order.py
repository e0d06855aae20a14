"""The options of a render on the command line, together and checked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from clfractal.errors import SceneError, Where


@dataclass(frozen=True, slots=True)
class Order:
    """The options of `clfractal render`, as they were given."""

    scene: str
    outputs: tuple[Path, ...] = ()
    device: str | tuple[str, ...] | None = None
    precision: str | None = None
    size: str | None = None
    overrides: tuple[str, ...] = ()
    region: str | None = None
    samples: int | None = None
    resume: bool = False
    stats: Path | None = None
    folder: Path | None = None
    """Where files that the scene names are looked for; None: beside it."""
    streamed: Path | None = None
    """The output that stands for standard output."""
    quality: str | None = None
    denoise: bool = False
    cluster: str | None = None


OF_RENDER = {"region": "--region", "precision": "--precision", "quality": "--quality"}
"""Arguments of Python functions, and the options that give them."""


@contextmanager
def naming_options(options: Mapping[str, str] = OF_RENDER) -> Iterator[None]:
    """Errors about arguments of Python functions become errors about the options that gave them."""
    try:
        yield
    except SceneError as error:
        option = options.get(error.where.path or "")
        if error.where.file is not None or option is None:
            raise
        raise SceneError(error.message, Where(option), details=error.details) from error
