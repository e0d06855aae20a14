"""The project's own palettes: a few colours each, mixed in Oklab so that none looks grey or dull."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.files.srgb import decode

Floats = npt.NDArray[np.float64]

# Oklab (Björn Ottosson, A perceptual color space for image processing, 2020): linear Rec. 709 to the eye's cones, and
# the cube roots of those to lightness, green-red and blue-yellow.
_TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours at equal distances, as sRGB in hexadecimal. A periodic one comes back to its first colour at its end."""

    colors: str
    periodic: bool = False


PALETTES = {
    # From dark to light: for quantities with a least and a largest value.
    "hearth": Palette("1b1213 4b1714 942a1a d95a1f f5a33c fdeabc"),
    "glacier": Palette("08192b 103f60 2b7699 6fb3c6 c1e2e4 f7fbfa"),
    "verdigris": Palette("20140f 5c3521 aa6a3e 8f9a78 4fae9a d2efe2"),
    "alabaster": Palette("2c221d 6d5747 b1977a e2d0b1 fbf6ea"),
    "abyss": Palette("070714 1b1850 4a2f92 3f82bd 62cbc0 ecfcd8"),
    "afterglow": Palette("140d31 421f63 92306f da566a f69d66 fde5ac"),
    "moss": Palette("141a12 2c4726 5f8236 aeb357 f0e6a8"),
    "absinthe": Palette("0b1d24 134849 338468 86b65a e3e27a fbfbe0"),
    # Round and round: for counts, and for quantities that are to show contours.
    "nacre": Palette("f5eee6 e9cbd4 c1c5e7 a8d6e0 c8e7d0 f4e9c6", periodic=True),
    "opal": Palette("14253f 1e7186 7dcdb6 f3e8c8 ee9f8a a4437a 3c2a69", periodic=True),
    "canyon": Palette("54261d ab4f2e e09f64 f3dfbd b98d72 744c50", periodic=True),
    "peacock": Palette("0a242d 17606a 43a184 d3bd62 8a5a2b 3a2148 142f78", periodic=True),
    "gilded": Palette("0d1632 2c3d6a 8a7c78 dca746 fcebbb b8742d 44201f", periodic=True),
    "porcelain": Palette("f7f3ea c5d3e4 5d86c1 1d3c84 5d86c1 c5d3e4", periodic=True),
    "aurora": Palette("0a1230 1c4962 44a187 ade09a e8e6c0 b26bb5 4a2a7d", periodic=True),
    "carnelian": Palette("2a0f14 8c1f22 e0593a f9c79a f4ead9 8fb0a8 2e5560", periodic=True),
}


def table(palette: Palette, size: int) -> npt.NDArray[np.float32]:
    """The palette as linear Rec. 709 at `size` equal distances from 0 to 1, shape (size, 3), within 0..1."""
    codes = np.array([list(bytes.fromhex(color)) for color in palette.colors.split()]) / 255
    curve = _smooth(to_oklab(decode(codes)), np.linspace(0.0, 1.0, size), palette.periodic)
    return np.clip(from_oklab(curve), 0.0, 1.0).astype(np.float32)


def to_oklab(linear: Floats) -> Floats:
    """Linear Rec. 709 to Oklab (lightness, green-red, blue-yellow), shape (..., 3); white is (1, 0, 0)."""
    found: Floats = np.cbrt(linear @ _TO_CONES.T) @ _TO_LAB.T
    return found


def from_oklab(lab: Floats) -> Floats:
    """Oklab to linear Rec. 709, shape (..., 3); colours outside the gamut have negative components."""
    return (lab @ np.linalg.inv(_TO_LAB).T) ** 3 @ np.linalg.inv(_TO_CONES).T


def _smooth(knots: Floats, places: Floats, periodic: bool) -> Floats:
    """A smooth curve through knots at equal distances that never leaves the range of two neighbours.

    Cubic Hermite pieces, their slopes the harmonic means of the chords (Fritsch and Butland 1984). Shapes: knots (n, 3),
    places (m,) in 0..1, result (m, 3).
    """
    if periodic:
        knots = np.concatenate([knots[-1:], knots, knots[:2]])
    else:
        knots = np.concatenate([2 * knots[:1] - knots[1:2], knots, 2 * knots[-1:] - knots[-2:-1]])
    chords = np.diff(knots, axis=0)
    product, total = chords[:-1] * chords[1:], chords[:-1] + chords[1:]
    slopes = np.where(product > 0, 2 * product / np.where(product > 0, total, 1.0), 0.0)
    values = knots[1:-1]
    at = places * (len(values) - 1)
    first = np.minimum(at.astype(int), len(values) - 2)
    t = (at - first)[:, None]
    before, beyond = values[first], values[first + 1]
    # Hermite's four polynomials.
    bend = slopes[first] * (1 - t) - slopes[first + 1] * t
    rise = (beyond - before) * (1 - 2 * t)
    found: Floats = before + (beyond - before) * t + t * (1 - t) * (bend - rise)
    return found
