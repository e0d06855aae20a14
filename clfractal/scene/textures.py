"""Finds the pictures that materials show, beside the scene; their pixels stay with the scene."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.activity import doing
from clfractal.errors import FileError, Where
from clfractal.files.inputs import note
from clfractal.scene.materials import PbrMaterial
from clfractal.schema.mapped import maps_of

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


def with_textures(materials: Mapping[str, PbrMaterial], names: Mapping[str, str]) -> dict[str, PbrMaterial]:
    """The materials with other names of their files; those without any are the same objects."""
    result = dict(materials)
    for name, material in materials.items():
        if any(each.texture in names for _, each in maps_of(material)):
            given = material.model_dump(exclude_unset=True)
            rename_textures(given, lambda file: names.get(file, file))
            result[name] = PbrMaterial.checked(given)
    return result


def rename_textures(data: Any, new: Callable[[str], str]) -> None:
    """Gives the files in plain data of materials other names."""
    if not isinstance(data, dict):
        return
    if isinstance(data.get("texture"), str):
        data["texture"] = new(data["texture"])
    for each in data.values():
        rename_textures(each, new)


def read_textures(materials: Mapping[str, PbrMaterial], folder: Path) -> dict[str, Texture]:
    """The pictures of a scene that was loaded from `folder`.

    Raises:
        FileError: at the key that names it, for a file out of the folder, or whatever is wrong with it.
    """
    files = texture_files(materials)
    if not files:
        return {}
    from clfractal.formulas.catalog import safe_path

    found = {}
    for file, key in files.items():
        where = Where(path=key)
        path = safe_path(file, folder, where)
        try:
            with doing(f"reading {path}"):
                found[file] = _read(path)
        except FileError as error:
            raise FileError(error.inside(str(path)), where, details=error.details) from error
    return found


def _read(path: Path) -> Texture:
    """A picture, which is not read again while its file stays as it is: scenes are loaded at every edit."""
    note(path)
    try:
        status = path.stat()
    except (OSError, ValueError):
        return _read_as(path, 0, 0)
    return _read_as(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=8)
def _read_as(path: Path, changed: int, size: int) -> Texture:
    from clfractal.files.texture import read_texture

    pixels, has_codes = read_texture(path)
    pixels.flags.writeable = False
    return Texture(pixels, has_codes)
