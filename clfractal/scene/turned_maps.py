"""Environment maps that lean or are mirrored, as upright maps of the same size."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from clfractal.device.threads import in_threads
from clfractal.files.map_directions import about_z, in_picture
from clfractal.scene.lighting import Environment

_PIXELS_AT_ONCE = 1 << 17

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]


def upright(pixels: Floats, environment: Environment) -> Floats:
    """The map that an environment shows when it is turned about z by its `rotation` alone; shape (height, width, 3).

    `rotation` is about `up`: so the map changes with it where `up` is not +z. Pixels are blended linearly.
    """
    if environment.is_upright:
        return np.ascontiguousarray(pixels[:, ::-1]) if environment.mirrored else pixels
    turn = about_z(environment.rotation)
    matrix = in_picture(environment.up, environment.rotation, environment.mirrored) @ turn
    height, width, _ = pixels.shape
    found = np.empty_like(pixels)
    azimuth = ((np.arange(width) + 0.5) / width - 0.5) * (2 * np.pi)
    level = np.stack([np.sin(azimuth), np.cos(azimuth)])
    band = max(1, _PIXELS_AT_ONCE // width)

    def fill(first: int) -> None:
        rows = slice(first, min(first + band, height))
        elevation = (0.5 - (np.arange(rows.start, rows.stop) + 0.5) / height) * np.pi
        across = np.cos(elevation)[:, None]
        x, y, z = (
            row[0] * across * level[0] + row[1] * across * level[1] + row[2] * np.sin(elevation)[:, None]
            for row in matrix
        )
        columns = (np.arctan2(x, y) / (2 * np.pi) + 0.5) * width - 0.5
        lines = np.clip((0.5 - np.arctan2(z, np.hypot(x, y)) / np.pi) * height - 0.5, 0, height - 1)
        found[rows] = _blended(pixels, columns, lines)

    in_threads(fill, range(0, height, band))
    return found


def _blended(pixels: Floats, columns: Doubles, lines: Doubles) -> Floats:
    """Pixels at places between their middles: around the sides, but not over the poles."""
    height, width, _ = pixels.shape
    left, top = np.floor(columns).astype(np.int64), lines.astype(np.int64)
    right = (columns - left)[..., None].astype(np.float32)
    low = (lines - top)[..., None].astype(np.float32)
    left, next_one, below = left % width, (left + 1) % width, np.minimum(top + 1, height - 1)
    upper = pixels[top, left] * (1 - right) + pixels[top, next_one] * right
    under = pixels[below, left] * (1 - right) + pixels[below, next_one] * right
    return np.asarray(upper * (1 - low) + under * low)
