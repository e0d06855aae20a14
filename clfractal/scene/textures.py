"""Finds the pictures that materials show, beside the scene; their pixels stay with the scene."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clfractal.errors import Where
from clfractal.scene.beside import reading_beside, state_of
from clfractal.scene.materials import PbrMaterial
from clfractal.scene.named_files import texture_files

Floats = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Texture:
    """`pixels` has the shape (height, width, 3): linear Rec. 709, finite, none below 0; the top row first.

    `has_codes`: its file has sRGB's codes, which stand for numbers where these are wanted.
    """

    pixels: Floats
    has_codes: bool = True

    @cached_property
    def digest(self) -> str:
        """A text that differs for different pixels."""
        found = hashlib.sha256(f"{self.pixels.shape} {self.has_codes}".encode())
        found.update(np.ascontiguousarray(self.pixels).data)
        return found.hexdigest()


def read_textures(materials: Mapping[str, PbrMaterial], folder: Path) -> dict[str, Texture]:
    """The pictures of a scene that was loaded from `folder`.

    Raises:
        FileError: at the key that names it, for a file out of the folder, or whatever is wrong with it.
    """
    found = {}
    for file, key in texture_files(materials).items():
        with reading_beside(file, folder, Where(path=key)) as path:
            found[file] = _read(path, *state_of(path))
    return found


@lru_cache(maxsize=8)
def _read(path: Path, changed: int, size: int) -> Texture:
    from clfractal.files.texture import read_texture

    found = read_texture(path)
    found.pixels.flags.writeable = False
    return Texture(found.pixels, found.has_codes)
