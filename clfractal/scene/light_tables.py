"""Finds the files that lights read, beside the scene; their tables stay with the scene."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from clfractal.device.activity import doing
from clfractal.errors import FileError, Where
from clfractal.files.inputs import note
from clfractal.schema.light import LightBase

Floats = npt.NDArray[np.float32]
Key: TypeAlias = tuple[str, str]
"""The word of a kind, and the name of a file that lights of this kind read."""


@dataclass(frozen=True, eq=False)
class LightTable:
    """What kernels read of a file, one-dimensional."""

    numbers: Floats

    @cached_property
    def digest(self) -> str:
        """A text that differs for different numbers."""
        return hashlib.sha256(np.ascontiguousarray(self.numbers).data).hexdigest()


def light_files(lights: Iterable[LightBase]) -> dict[Key, str]:
    """The files that lights read, and of each the path of the key that names it first."""
    found: dict[Key, str] = {}
    for number, light in enumerate(lights):
        if light.reads is not None:
            found.setdefault((light.tag, light.reads), f"lights.{number}.file")
    return found


def with_light_files(lights: tuple[LightBase, ...], names: Mapping[str, str]) -> tuple[LightBase, ...]:
    """The lights with other names of their files; those without any are the same objects."""
    return tuple(
        light.model_copy(update={"file": names[light.reads]})
        if light.reads and light.reads in names
        else light
        for light in lights
    )


def read_light_tables(lights: tuple[LightBase, ...], folder: Path) -> dict[Key, LightTable]:
    """The tables of a scene that was loaded from `folder`.

    Raises:
        FileError: at the key that names it, for a file out of the folder, or whatever is wrong with it.
    """
    from clfractal.formulas.catalog import safe_path

    kinds, found = {light.tag: type(light) for light in lights}, {}
    for (tag, file), key in light_files(lights).items():
        where = Where(path=key)
        path = safe_path(file, folder, where)
        try:
            with doing(f"reading {path}"):
                found[tag, file] = _read(kinds[tag], path)
        except FileError as error:
            raise FileError(error.inside(str(path)), where, details=error.details) from error
    return found


def _read(kind: type[LightBase], path: Path) -> LightTable:
    """A table, which is not read again while its file stays as it is: scenes are loaded at every edit."""
    note(path)
    try:
        status = path.stat()
    except (OSError, ValueError):
        return _read_as(kind, path, 0, 0)
    return _read_as(kind, path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=32)
def _read_as(kind: type[LightBase], path: Path, changed: int, size: int) -> LightTable:
    numbers = np.array(kind.table_of(path), np.float32)
    numbers.flags.writeable = False
    return LightTable(numbers)
