"""Two eyes' pictures of random numbers, in memory or on disk."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clfractal.images.compose import eye_regions
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.modes import eye_size, picture_size
from clfractal.images.store import JournalFramebuffer
from clfractal.images.tiles import Region
from clfractal.scene.stereo import Stereo

CHANNELS = ("R", "G", "B", "A", "Z", "N.X")
PLACED = ("split", "over_under", "split_half", "over_under_half")
PICKED = ("rows", "columns", "checkerboard", "anaglyph_chessboard")
COMPOSED = (*PLACED, *PICKED, "anaglyph", "left", "right")


def stereo(mode: str, **settings: Any) -> Stereo:
    return Stereo.model_validate({"mode": mode, **settings})


def eyes(size: tuple[int, int], seed: int = 5) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """The left and the right eye's planes, of `size` (width, height)."""
    source = np.random.default_rng(seed)
    shape = (2, len(CHANNELS), size[1], size[0])
    left, right = (
        dict(zip(CHANNELS, planes, strict=True)) for planes in source.random(shape, dtype=np.float32)
    )
    return left, right


def filled(store: Framebuffer | JournalFramebuffer, planes: dict[str, np.ndarray]) -> Any:
    """The store with its part of the planes, which are of the whole picture."""
    for index in range(store.grid.count):
        tile = store.grid.tile(index)
        part = (slice(tile.y, tile.y + tile.height), slice(tile.x, tile.x + tile.width))
        store.put(index, np.array([planes[name][part] for name in store.channels]))
    return store


def framebuffers(
    scene: Stereo,
    image: tuple[int, int],
    region: Region | None,
    planes: tuple[dict[str, np.ndarray], ...],
    make: Callable[..., Any] = lambda side, size, part: Framebuffer(CHANNELS, size, part),
) -> tuple[Any, Any]:
    """What a region of the finished picture needs of each eye's; None where it needs nothing."""
    parts = eye_regions(scene, image, region or Region(0, 0, *picture_size(scene, image)))
    left, right = (
        part and filled(make(side, eye_size(scene, image), part), of)
        for (side, part), of in zip(parts.items(), planes, strict=True)
    )
    return left, right
