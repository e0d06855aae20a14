"""Finds the files that lights read, beside the scene; their tables stay with the scene."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clfractal.errors import Where
from clfractal.scene.beside import reading_beside, state_of
from clfractal.scene.named_files import Key, light_files
from clfractal.schema.light import LightBase

Floats = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class LightTable:
    """What kernels read of a file, one-dimensional."""

    numbers: Floats

    @cached_property
    def digest(self) -> str:
        """A text that differs for different numbers."""
        return hashlib.sha256(np.ascontiguousarray(self.numbers).data).hexdigest()


def read_light_tables(lights: tuple[LightBase, ...], folder: Path) -> dict[Key, LightTable]:
    """The tables of a scene that was loaded from `folder`.

    Raises:
        FileError: at the key that names it, for a file out of the folder, or whatever is wrong with it.
    """
    kinds, found = {light.tag: type(light) for light in lights}, {}
    for (tag, file), key in light_files(lights).items():
        with reading_beside(file, folder, Where(path=key)) as path:
            found[tag, file] = _read(kinds[tag], path, *state_of(path))
    return found


@lru_cache(maxsize=32)
def _read(kind: type[LightBase], path: Path, changed: int, size: int) -> LightTable:
    numbers = np.array(kind.table_of(path), np.float32)
    numbers.flags.writeable = False
    return LightTable(numbers)
