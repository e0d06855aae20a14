"""Finds the pictures that materials show, beside the scene; their pixels stay with the scene."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clfractal.device.activity import doing
from clfractal.errors import FileError, Where
from clfractal.scene.maps import maps_of
from clfractal.scene.materials import PbrMaterial

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


def texture_files(materials: Mapping[str, PbrMaterial]) -> dict[str, str]:
    """The files that materials name, and of each the path of the key that names it first."""
    found: dict[str, str] = {}
    for name, material in materials.items():
        for key, each in maps_of(material):
            if each.texture is not None:
                found.setdefault(each.texture, f"materials.{name}.{key}.texture")
    return found


def read_textures(materials: Mapping[str, PbrMaterial], folder: Path) -> dict[str, Texture]:
    """The pictures of a scene that was loaded from `folder`.

    Raises:
        FileError: at the key that names it, for a file out of the folder, or whatever is wrong with it.
    """
    files = texture_files(materials)
    if not files:
        return {}
    from clfractal.files.texture import read_texture
    from clfractal.formulas.catalog import safe_path

    found = {}
    for file, key in files.items():
        where = Where(path=key)
        path = safe_path(file, folder, where)
        try:
            with doing(f"reading {path}"):
                pixels, has_codes = read_texture(path)
                found[file] = Texture(pixels, has_codes)
        except FileError as error:
            raise FileError(error.inside(str(path)), where, details=error.details) from error
    return found
