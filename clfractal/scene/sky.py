"""A physical sky as a latitude-longitude map, with the ground below and the sun's disc before it.

`atmosphere.py` gives light by wavelength. It becomes CIE XYZ by the fits of Wyman, Sloan and Shirley (Simple
Analytic Approximations to the CIE XYZ Color Matching Functions, JCGT 2 (2), 2013), the sun being a black body of
5778 K, and then linear Rec. 709; colours outside it are cut at 0.

The scale is fixed: the sun above the air gives `SUNLIGHT`, so that a white ground under a sun at 45 degrees and
turbidity 3 has a luminance of 1, and middle grey comes out at 0.18.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import pi
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from clfractal.device.threads import in_threads
from clfractal.scene.atmosphere import (
    EARTH,
    WAVELENGTHS,
    Atmosphere,
    Doubles,
    aerosol_phase,
    rayleigh_phase,
    sun_visible,
)

if TYPE_CHECKING:
    from clfractal.scene.lighting import Sky

WIDTH, HEIGHT = 2048, 1024
"""Of the map, which shows no sun."""
SUNLIGHT = 4.973
"""Luminance times pi that a white surface facing the sun would have above the air: see the scale."""

EYE = EARTH + 0.05
"""Where the sky is seen from: 50 m above the ground, so that the horizon lies 0.2 degrees below the level."""
_ROWS, _AZIMUTHS = 96, 49
_ROWS_AT_ONCE, _RAYS_AT_ONCE = 16, 4

Floats = npt.NDArray[np.float32]


@lru_cache(maxsize=4)
def bake(sky: Sky) -> Floats:
    """The map of a sky, shape (HEIGHT, WIDTH, 3): linear Rec. 709, finite, none below 0; not to be written to."""
    elevation = np.radians(sky.sun_elevation)
    air = Atmosphere(sky.turbidity, elevation)
    sun = np.array(np.sin(elevation))
    dip = -np.arccos(EARTH / EYE)
    rows: Doubles = pi / 2 - (np.arange(HEIGHT, dtype=np.float64) + 0.5) * (pi / HEIGHT)
    above = int((rows > dip).sum())
    azimuth: Doubles = np.radians(((np.arange(WIDTH) + 0.5) / WIDTH - 0.5) * 360 - sky.sun_azimuth)
    radius = np.array(EARTH)
    direct = to_rgb(air.transmittance(radius, sun)) * sun_visible(radius, sun) * max(float(sun), 0.0)
    found = np.empty((HEIGHT, WIDTH, 3), np.float32)
    _show(found[:above], _Parts.of(air, sun, rows[:above], (dip + 1e-6, pi / 2)), azimuth)
    irradiance = np.maximum(direct + _irradiance(found[:above], rows[:above]), 0)
    end = np.linspace(0, 1, _ROWS) ** 2 * (-pi / 2 - dip) + dip - 1e-6
    through = to_rgb(air.scattered(EYE, np.sin(end), np.zeros(1), sun, whole=False).through) / to_rgb(
        np.ones_like(WAVELENGTHS)
    )
    seen = _between(through, np.sqrt((rows[above:] - dip) / (-pi / 2 - dip)) * (_ROWS - 1))
    ground = seen * irradiance * sky.ground_color / pi
    _show(found[above:], _Parts.of(air, sun, rows[above:], (dip - 1e-6, -pi / 2)), azimuth, ground)
    found.flags.writeable = False
    return found


def to_rgb(spectrum: Doubles) -> Doubles:
    """Linear Rec. 709 of what is left of sunlight, shape (..., wavelengths); all of it has the luminance `SUNLIGHT`."""
    found: Doubles = np.einsum("...w,wk->...k", spectrum, _spectrum_to_rgb())
    return found


def pixel_areas() -> Doubles:
    """Of the pixels of each row, steradians, shape (HEIGHT,)."""
    borders = np.cos(np.linspace(0, pi, HEIGHT + 1))
    return (borders[:-1] - borders[1:]) * (2 * pi / WIDTH)


@lru_cache(maxsize=1)
def _spectrum_to_rgb() -> Doubles:
    def lobe(middle: float, left: float, right: float) -> Doubles:
        offset = WAVELENGTHS - middle
        return np.exp(-0.5 * (offset * np.where(offset < 0, left, right)) ** 2)

    x = 0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323)
    x -= 0.065 * lobe(501.1, 0.0490, 0.0382)
    y = 0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322)
    z = 1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725)
    planck = WAVELENGTHS**-5 / np.expm1(1.438777e7 / (WAVELENGTHS * 5778))
    xyz = np.stack([x, y, z], axis=-1) * planck[:, None]
    to_709 = np.linalg.inv(
        np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    )
    found: Doubles = SUNLIGHT / xyz[:, 1].sum() * xyz @ to_709.T
    return found


@dataclass(frozen=True, slots=True)
class _Parts:
    """Scattered light without its phases, at some elevations: by molecules, by aerosol, and many times.

    Attributes:
        light: shape (rows, 9, _AZIMUTHS): three colours of each part, at angles around the sun.
        rows: the elevations.
        sun: mu of the sun.
    """

    light: Floats
    rows: Doubles
    sun: float

    @classmethod
    def of(cls, air: Atmosphere, sun: Doubles, rows: Doubles, ends: tuple[float, float]) -> _Parts:
        """At elevations `rows` between `ends`, the horizon first: blended from a grid that is fine there."""
        around = np.linspace(0, pi, _AZIMUTHS)
        grid = ends[0] + np.linspace(0, 1, _ROWS) ** 2 * (ends[1] - ends[0])
        some = np.sin(grid).reshape(-1, _RAYS_AT_ONCE, 1)
        found = in_threads(lambda mu: air.scattered(EYE, mu, around, sun), [*some])
        place = np.sqrt(np.clip((rows - ends[0]) / (ends[1] - ends[0]), 0, 1)) * (_ROWS - 1)
        parts = [
            to_rgb(np.concatenate(part))
            for part in zip(*((each.molecules, each.aerosol, each.many) for each in found), strict=True)
        ]
        light = _between(np.concatenate(parts, axis=-1), place).swapaxes(1, 2)
        return cls(np.ascontiguousarray(light, np.float32), rows, float(sun))


def _show(pixels: Floats, parts: _Parts, azimuth: Doubles, more: Doubles | None = None) -> None:
    """Writes the light of rows, at angles from the sun's, and what each row has besides, shape (rows, 3).

    The integrals change slowly, and are blended; the phase functions, which do not, are exact at each pixel.
    """
    from_sun = np.arccos(np.clip(np.cos(azimuth), -1, 1)) / pi * (_AZIMUTHS - 1)
    first = np.minimum(from_sun.astype(int), _AZIMUTHS - 2)
    part = (from_sun - first).astype(np.float32)
    level = np.sqrt(1 - parts.sun**2) * np.cos(azimuth)

    def show(row: int) -> None:
        some = slice(row, row + _ROWS_AT_ONCE)
        rows = parts.rows[some, None]
        cosine = (np.sin(rows) * parts.sun + np.cos(rows) * level).astype(np.float32)[:, None]
        light = np.take(parts.light[some], first, axis=2) * (1 - part)
        light += np.take(parts.light[some], first + 1, axis=2) * part
        molecules, aerosol, shown = light[:, :3], light[:, 3:6], light[:, 6:]
        shown += np.multiply(molecules, rayleigh_phase(cosine), out=molecules)
        shown += np.multiply(aerosol, aerosol_phase(cosine), out=aerosol)
        if more is not None:
            shown += more[some, :, None].astype(np.float32)
        np.maximum(shown.swapaxes(1, 2), 0, out=pixels[some])

    in_threads(show, range(0, len(parts.rows), _ROWS_AT_ONCE))


def _between(values: Doubles, place: Doubles) -> Doubles:
    """Values of the first axis, blended linearly."""
    first = np.minimum(place.astype(int), len(values) - 2)
    part = (place - first).reshape(-1, *[1] * (values.ndim - 1))
    found: Doubles = values[first] * (1 - part) + values[first + 1] * part
    return found


def _irradiance(pixels: Floats, rows: Doubles) -> Doubles:
    """Of a level surface under the rows from the top, shape (3,)."""
    weights = pixel_areas()[: len(rows)] * np.maximum(np.sin(rows), 0)
    found: Doubles = weights @ pixels.sum(axis=1, dtype=np.float64)
    return found
