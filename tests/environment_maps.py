"""Maps of surroundings in files, for scenes that name one, and the light that they bring by NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.files.exr import write_exr

Floats = npt.NDArray[np.floating[Any]]


def write_map(path: Path, pixels: float | Floats = 0.5, size: tuple[int, int] = (8, 4)) -> Path:
    """Of one grey, or of pixels that are grey, shape (height, width), or coloured."""
    path.parent.mkdir(exist_ok=True)
    colors = np.full(size[::-1], pixels) if np.isscalar(pixels) else np.asarray(pixels)
    planes = np.broadcast_to(np.moveaxis(np.atleast_3d(colors), -1, 0), (3, *colors.shape[:2]))
    height, width = colors.shape[:2]
    band = dict(zip("RGB", planes.astype(np.float32), strict=True))
    write_exr(path, [band], display=(width, height), region=(0, 0, width, height), channels="RGB", half="")
    return path


def place(directions: Floats, rotation: float = 0.0) -> tuple[Floats, Floats]:
    """Parts of the picture's width and height: +y in the middle, +x right of it, +z at the top; degrees about z."""
    turn = np.radians(rotation)
    x = np.cos(turn) * directions[..., 0] + np.sin(turn) * directions[..., 1]
    y = np.cos(turn) * directions[..., 1] - np.sin(turn) * directions[..., 0]
    z = directions[..., 2]
    return np.arctan2(x, y) / (2 * np.pi) + 0.5, 0.5 - np.arctan2(z, np.hypot(x, y)) / np.pi


def blended(pixels: Floats, across: Floats, below: Floats) -> Floats:
    """Linear between the pixels' middles; around the sides, but not over the poles."""
    height, width, _ = pixels.shape
    x, y = across * width - 0.5, np.clip(below * height - 0.5, 0, height - 1)
    left, top = np.floor(x).astype(int), np.minimum(y.astype(int), height - 1)
    s, t = (x - left)[..., None], (y - top)[..., None]
    upper, lower = (
        pixels[row, left % width] * (1 - s) + pixels[row, (left + 1) % width] * s
        for row in (top, np.minimum(top + 1, height - 1))
    )
    return np.asarray(upper * (1 - t) + lower * t)


def irradiance(pixels: Floats, normals: Floats) -> Floats:
    """Light from all sides by the cosine to normals (n, 3), over pi: the map's pixels summed by their solid angles."""
    height, width = pixels.shape[:2]
    rows, columns = (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width
    azimuth, elevation = (2 * columns - 1) * np.pi, (0.5 - rows) * np.pi
    level, up = np.broadcast_arrays(np.cos(elevation)[:, None], np.sin(elevation)[:, None])
    ways = np.stack(np.broadcast_arrays(level * np.sin(azimuth), level * np.cos(azimuth), up), -1)
    part = level * np.ones(width) * (np.pi / height) * (2 * np.pi / width)
    cosine = np.maximum(normals @ ways.reshape(-1, 3).T, 0)
    return np.asarray(cosine @ (part[..., None] * np.atleast_3d(pixels)).reshape(height * width, -1) / np.pi)
