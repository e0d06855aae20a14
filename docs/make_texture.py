"""Makes docs/textures/marble.jpg, a picture without seams for the pages: dark stone with bright veins.

python docs/make_texture.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

SIDE = 256
Doubles = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]


def waves(random: np.random.Generator, coarse: int, fine: int) -> Doubles:
    """Noise that repeats, from -1 to 1: waves of a picture's parts `coarse` to `fine`, the finer the lower."""
    found = np.zeros((SIDE, SIDE), np.complex128)
    for x in range(-fine, fine + 1):
        for y in range(-fine, fine + 1):
            size = np.hypot(x, y)
            if coarse <= size <= fine:
                found[y, x] = np.exp(2j * np.pi * random.random()) / size**1.5
    noise = np.fft.ifft2(found).real
    return np.asarray(noise / np.abs(noise).max())


def marble() -> Picture:
    """Codes, shape (SIDE, SIDE, 3)."""
    random = np.random.default_rng(21)
    broad, small, tint = waves(random, 1, 8), waves(random, 4, 40), waves(random, 1, 20)
    # Veins lie where a noise is 0.
    veins = np.exp(-(((broad + 0.12 * small) / 0.035) ** 2)) + 0.5 * np.exp(
        -(((tint + 0.2 * small) / 0.03) ** 2)
    )
    stone = np.array([20.0, 52.0, 46.0]) * (1 + 0.5 * small + 0.35 * tint)[..., None]
    vein = np.array([232.0, 214.0, 178.0])
    mixed = stone + np.clip(veins, 0, 1)[..., None] * (vein - stone)
    return np.clip(np.round(mixed), 0, 255).astype(np.uint8)


if __name__ == "__main__":
    folder = Path(__file__).resolve().parent / "textures"
    folder.mkdir(exist_ok=True)
    Image.fromarray(marble()).save(folder / "marble.jpg", quality=88)
