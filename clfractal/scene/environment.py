"""Finds a scene's environment map, in the program or beside the scene, or makes a sky."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clfractal.device.activity import doing
from clfractal.errors import SceneError, Where, unknown_name
from clfractal.files import resources
from clfractal.scene.beside import reading_beside, state_of

if TYPE_CHECKING:
    from clfractal.scene.lighting import Environment
    from clfractal.scene.sun import Sun

Floats = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class EnvironmentMap:
    """`pixels` has the shape (height, 2 height, 3): linear Rec. 709, finite, none below 0.

    `is_shipped`: it comes with the program, and stays in memory once it was read. `sun`: the disc before a sky.
    """

    pixels: Floats
    is_shipped: bool = False
    sun: Sun | None = None

    @cached_property
    def digest(self) -> str:
        """A text that differs for different light."""
        found = hashlib.sha256(np.ascontiguousarray(self.pixels).data)
        if self.sun is not None:
            found.update(repr(self.sun).encode())
        return found.hexdigest()


@cache
def names() -> tuple[str, ...]:
    """The names of the maps that come with the program, sorted."""
    return tuple(sorted(path.stem for path in resources.folder("environments").glob("*.exr")))


def check_name(environment: Environment) -> None:
    """Raises SceneError, at environment.name, for a name that no map has."""
    if environment.name is not None and environment.name not in names():
        raise SceneError(
            unknown_name("environment", environment.name, names()), Where(path="environment.name")
        )


def read_map(environment: Environment, folder: Path) -> EnvironmentMap:
    """The map of a scene that was loaded from `folder`.

    Raises:
        SceneError: at environment.name, for an unknown name.
        FileError: at environment.file, for a file out of the folder, or whatever is wrong with it.
    """
    check_name(environment)
    if environment.sky is not None:
        # Loaded for skies only.
        from clfractal.scene.sky import bake
        from clfractal.scene.sun import sun_of

        with doing("making the sky"):
            return EnvironmentMap(bake(environment.sky), sun=sun_of(environment.sky))
    if environment.file is None:
        found = _shipped(environment.name or "")
    else:
        with reading_beside(environment.file, folder, Where(path="environment.file")) as path:
            found = EnvironmentMap(_read(path, environment.stretch, *state_of(path)))
    if environment.is_upright and not environment.mirrored:
        return found
    # Most are upright.
    from clfractal.scene.turned_maps import upright

    with doing("turning the environment"):
        return EnvironmentMap(upright(found.pixels, environment))


@lru_cache(maxsize=1)  # they may be large
def _read(path: Path, stretch: bool, changed: int, size: int) -> Floats:
    from clfractal.files.environment_map import read_environment

    pixels = read_environment(path, stretch=stretch)
    pixels.flags.writeable = False
    return pixels


@cache
def _shipped(name: str) -> EnvironmentMap:
    """A map that comes with the program; it is small and read only once."""
    from clfractal.files.environment_map import read_environment

    pixels = read_environment(resources.folder("environments") / f"{name}.exr")
    pixels.flags.writeable = False
    return EnvironmentMap(pixels, is_shipped=True)
