"""Small pictures of scene files, kept on the disk for the window's gallery and the shell's sheets.

Kept pictures are optional, as all of the cache is: without them they are rendered again.
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from itertools import takewhile
from pathlib import Path

import numpy as np
import numpy.typing as npt

from clfractal.device import cache
from clfractal.engine.variations import small_scene
from clfractal.errors import ClfractalError
from clfractal.files import resources
from clfractal.files.png import read_png_pixels, write_png_pixels
from clfractal.scene.load import dump_scene
from clfractal.scene.model import Scene

Pixels = npt.NDArray[np.uint8]

SIZE = (480, 270)
"""Pixels of a picture: the window shows it at half that size, or on a screen of twice the resolution."""
SAMPLES = 4
"""Of a pixel."""
MOST_KEPT = 500
"""Pictures on the disk; the oldest go first. One has some 250 KB."""
_TAKES = re.compile(r"Takes (about|some)? ?[^.]*\d+ x \d+[^.]*\.")


def shown_scene(scene: Scene) -> Scene:
    """The scene as its small picture shows it: with few samples, and grids that fill at once."""
    small = small_scene(scene, *SIZE)
    updates = {"renderer": small.renderer.model_copy(update={"samples": SAMPLES})}
    return small.model_copy(update=updates)


def words_of(text: str) -> tuple[str, str]:
    """The title and the description that a scene file begins with: its first lines of comment.

    How long the picture takes at its full size is left out.
    """
    comment = takewhile(lambda line: line.startswith("#"), text.splitlines())
    lines = [line.lstrip("#").strip() for line in comment]
    about = " ".join(lines[1:]).replace("`", "")
    return (lines[0] if lines else "", _TAKES.sub("", about).strip())


def key_of(scene: Scene, device: str) -> str:
    """What a picture is kept under.

    Args:
        scene: as `shown_scene` gives it.
        device: key of the device that renders it (`DeviceInfo.key`).
    """
    return cache.key_of("thumbnail", dump_scene(scene), resources.__version__, device, SIZE)


def load(key: str) -> Pixels | None:
    """A kept picture, shape (270, 480, 3); None if there is none."""
    path = _place(key)
    try:
        found = read_png_pixels(path)
    except ClfractalError:
        return None
    if found.shape != (SIZE[1], SIZE[0], 3):
        return None
    with suppress(OSError):
        os.utime(path)  # the time of last use decides what goes first
    return found


def store(key: str, pixels: Pixels) -> None:
    """Keeps a picture, shape (270, 480, 3 or 4), unless the disk has no room for it."""
    path = _place(key)
    with suppress(OSError, ClfractalError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_png_pixels(path, np.ascontiguousarray(pixels[..., :3]))
        kept = sorted(path.parent.glob("*.png"), key=lambda each: each.stat().st_mtime)
        for each in kept[: max(len(kept) - MOST_KEPT, 0)]:
            each.unlink(missing_ok=True)


def _place(key: str) -> Path:
    return cache.folder() / "thumbnails" / f"{key}.png"
