"""Small pictures kept in the cache folder, so that a gallery is there at once the next time it is opened.

As for all of the cache, no function here raises an error because of the disk: what cannot be read is rendered again.
"""

from __future__ import annotations

import os
import secrets
from contextlib import suppress
from pathlib import Path

import numpy as np
import numpy.typing as npt

import clfractal
from clfractal.device import cache
from clfractal.errors import ClfractalError
from clfractal.files.png import read_png_pixels, write_png_pixels

Pixels = npt.NDArray[np.uint8]

MOST_FILES = 600
"""Of so many pictures, some 100 KB each, the oldest go first."""
_FORMAT = 1


def key_of(text: str, device: str, size: tuple[int, int]) -> str:
    """The name of a scene's small picture: another text, program, device or size has another one.

    Args:
        text: of the scene's file.
        device: `DeviceInfo.key`.
        size: width and height, pixels.
    """
    return cache.key_of("thumbnail", _FORMAT, clfractal.__version__, device, list(size), text)


class ThumbnailFiles:
    """The pictures in one folder; may be used from several threads and processes at once.

    Args:
        folder: by default `thumbnails` in the user's cache folder.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder if folder is not None else cache.folder() / "thumbnails"

    def read(self, key: str, size: tuple[int, int]) -> Pixels | None:
        """A picture, shape (height, width, 4); None if there is none, or if it is damaged (its file then goes)."""
        path = self._path(key)
        if not path.is_file():
            return None
        try:
            found = read_png_pixels(path)
        except ClfractalError:
            found = None
        if found is None or found.shape != (size[1], size[0], 3):
            with suppress(OSError):
                path.unlink()
            return None
        with suppress(OSError):
            os.utime(path)  # the time of last use decides what is dropped first
        pixels = np.full((*found.shape[:2], 4), 255, np.uint8)
        pixels[..., :3] = found
        return pixels

    def write(self, key: str, pixels: Pixels) -> None:
        """Keeps a picture, shape (height, width, 4), opaque. Readers see all of it or nothing."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_png_pixels(self._path(key), np.ascontiguousarray(pixels[..., :3]), {})
            # Not with each file: looking at all of them takes longer than writing one.
            if secrets.randbelow(16) == 0:
                self._drop_oldest()
        except (OSError, ClfractalError):
            pass

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.png"

    def _drop_oldest(self) -> None:
        files = list(self.folder.glob("*.png"))
        if len(files) <= MOST_FILES:
            return
        ages = {}
        for file in files:
            with suppress(OSError):
                ages[file] = file.stat().st_mtime
        for file in sorted(ages, key=lambda file: ages[file])[: len(ages) - MOST_FILES * 3 // 4]:
            with suppress(OSError):
                file.unlink()
