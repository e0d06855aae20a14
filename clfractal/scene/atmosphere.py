"""The light of the sky: sunlight that the air of a round earth scatters, by wavelength.

Molecules, aerosol and ozone; single scattering is integrated along each view ray, all further scattering is
taken as the same in all directions (Hillaire, A Scalable and Production Ready Sky and Atmosphere Rendering
Technique, EGSR 2020, section 5.5). Lengths are kilometres. Directions are given by `mu`, the sine of the
elevation at the place where a ray starts. The sun's irradiance above the air is 1 at each wavelength.

The constants: Rayleigh optical depth by Hansen and Travis (Light scattering in planetary atmospheres, 1974,
eq. 2.29); aerosol by Angstrom's law with exponent 1.3, as much as makes the air's turbidity (McCartney, Optics of
the Atmosphere, 1976: whole optical depth over that of molecules alone, here at 550 nm without ozone); the Chappuis
band of 300 Dobson units of ozone as one Gaussian, within about a third of what is measured at its flanks.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import exp, pi
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from clfractal.device.threads import in_threads

Doubles = npt.NDArray[np.float64]
Singles = npt.NDArray[np.float32]
Reals = TypeVar("Reals", npt.NDArray[np.float64], npt.NDArray[np.float32])

WAVELENGTHS: Doubles = np.arange(395.0, 720.0, 20.0)
"""Nanometres."""

EARTH, TOP = 6360.0, 6460.0
"""Radii of the ground and of the air's end, kilometres."""
SUN_RADIUS = float(np.radians(0.2665))
"""Of its disc at the mean distance, radians."""

_MOLECULES, _AEROSOL = 8.0, 1.2  # heights in which the density falls to 1/e
_OZONE_HEIGHT, _OZONE_REACH = 25.0, 15.0  # its density is a tent
_ALBEDO = 0.93  # of the aerosol: what it does not absorb
_FORWARD = 0.76  # mean cosine of its scattering
_GROUND = 0.25  # what the ground sends back, where many scatterings only are concerned
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)
_PART: Singles = ((_NODES + 1) / 2).astype(np.float32)
_OF_PART: Singles = ((_NODES + 1) / 2 * _WEIGHTS).astype(np.float32)
_LEVELS, _SUNS = 16, 40  # the table of many scatterings
_SPAN = np.arccos(EARTH / TOP) * 1.02  # what a ray from near the ground spans of the earth, radians


def rayleigh_phase(cosine: Reals) -> Reals:
    """Per steradian."""
    found: Reals = 3 / (16 * pi) * (1 + cosine**2)
    return found


def aerosol_phase(cosine: Reals) -> Reals:
    """Per steradian: Cornette and Shanks, Applied Optics 31 (1992)."""
    g = _FORWARD
    square = 1 + g * g - 2 * g * cosine
    found: Reals = 3 / (8 * pi) * (1 - g * g) / (2 + g * g) * (1 + cosine**2) / (square * np.sqrt(square))
    return found


def columns(radius: Doubles, mu: Doubles) -> Doubles:
    """How much of each lies on a ray to the air's end, 1 being the whole vertical column; shape (..., 3).

    The ground does not end the ray.
    """
    return np.moveaxis(_columns(radius, mu), 0, -1).astype(np.float64)


def _columns(radius: Doubles, mu: Doubles) -> Singles:
    """The same in float32, shape (3, ...)."""
    length = _to_sphere(radius, mu, TOP).astype(np.float32)
    along = length[..., None] * _PART**2  # more points where the air is dense
    # The height is a difference of squares over a sum, so that float32 is enough, and takes a fifth of the time.
    height = along + (2 * radius * mu).astype(np.float32)[..., None]
    height *= along
    height += (radius**2 - EARTH**2).astype(np.float32)[..., None]
    both = np.add(height, np.float32(EARTH**2), out=along)
    np.sqrt(both, out=both)
    both += np.float32(EARTH)
    height /= both
    # (Not by matrix products: their library starts threads of its own, which wait for busy cores.)
    found = np.stack([np.einsum("...n,n->...", each, _OF_PART) for each in _densities(height)])
    found *= length
    return found


def _densities(height: npt.NDArray[Any]) -> Iterator[Singles]:
    """Of each gas, in the same memory one after the other. Once the height is known float32 is enough."""
    above = np.maximum(height, 0.0).astype(np.float32, copy=False)
    found = np.empty_like(above)
    for scale in (_MOLECULES, _AEROSOL):
        column = scale * (1 - exp(-(TOP - EARTH) / scale))
        np.multiply(above, np.float32(-1 / scale), out=found)
        np.exp(found, out=found)
        found *= np.float32(1 / column)
        yield found
    np.subtract(above, np.float32(_OZONE_HEIGHT), out=found)
    np.abs(found, out=found)
    found *= np.float32(-1 / _OZONE_REACH**2)
    found += np.float32(1 / _OZONE_REACH)
    np.maximum(found, np.float32(0), out=found)
    yield found


def sun_visible(radius: Doubles, mu: Doubles) -> Doubles:
    """Which part of the sun stands above the horizon, its middle being at `mu`: about, 0 to 1."""
    dip = np.arccos(np.minimum(EARTH / radius, 1.0))
    part = np.clip((np.arcsin(np.clip(mu, -1, 1)) + dip) / (2 * SUN_RADIUS) + 0.5, 0, 1)
    return part * part * (3 - 2 * part)


def _to_sphere(radius: Doubles, mu: Doubles, sphere: float) -> Doubles:
    """Distance to a sphere around the place."""
    inside = np.maximum(sphere**2 - radius**2 * (1 - mu**2), 0.0)
    return np.maximum(-radius * mu + np.sqrt(inside), 0.0)


def ray_length(radius: Doubles, mu: Doubles) -> tuple[Doubles, npt.NDArray[np.bool_]]:
    """How long a ray stays in the air, and whether it ends on the ground."""
    lowest = EARTH**2 - radius**2 * (1 - mu**2)
    ground = (mu < 0) & (lowest > 0)
    down = np.maximum(-radius * mu - np.sqrt(np.maximum(lowest, 0.0)), 0.0)
    return np.where(ground, down, _to_sphere(radius, mu, TOP)), ground


@dataclass(frozen=True, slots=True)
class Scattered:
    """Light that comes along rays, shape (..., wavelengths); multiply the first two by their phase functions."""

    molecules: Doubles
    aerosol: Doubles
    many: Doubles
    through: Doubles
    """The part of light from the ray's end that arrives; shape as mu, wavelengths."""


class Atmosphere:
    """Air of a turbidity, at least 1.

    Args:
        elevation: of the sun where rays begin, near the ground, radians. None: they begin anywhere, under any sun. Where
            they lead it stands higher or lower, at most by the part of the earth that they span; light of many scatterings
            is found for such elevations alone.
    """

    def __init__(self, turbidity: float, elevation: float | None = None) -> None:
        micro = WAVELENGTHS / 1000
        self.depths: Doubles = np.stack(  # vertical optical depths, (3, wavelengths)
            [
                rayleigh_depth(micro),
                (turbidity - 1) * rayleigh_depth(np.array(0.55)) * (micro / 0.55) ** -1.3,
                0.0404 * np.exp(-0.5 * ((WAVELENGTHS - 590) / 50) ** 2),
            ]
        )
        self.scattering = self.depths[:2] * np.array([[1.0], [_ALBEDO]])
        self._heights: Doubles = (TOP - EARTH - 1) * np.linspace(0, 1, _LEVELS) ** 2
        angles = pi / 2 * np.linspace(-0.5, 1, _SUNS)
        self._mus: Doubles = np.sin(angles)
        reach = _SPAN + angles[1] - angles[0] if elevation is not None else np.inf
        self._needed = np.abs(angles - (elevation or 0.0)) <= reach

    @cached_property
    def _many(self) -> Doubles:
        """The light of many scatterings: (wavelengths, heights, suns); no number where it is not needed."""
        found = np.full((len(WAVELENGTHS), _LEVELS, _SUNS), np.nan)
        radii = [EARTH + float(height) for height in self._heights]
        found[:, :, self._needed] = np.moveaxis(np.stack(in_threads(self._many_at, radii)), -1, 0)
        return found

    def transmittance(self, radius: Doubles, mu: Doubles) -> Doubles:
        """The part of light from outside the air that arrives, without regard to the ground: Beer and Lambert's law."""
        return np.moveaxis(self._left(radius, mu), 0, -1).astype(np.float64)

    def scattered(
        self,
        radius: float,
        mu: Doubles,
        azimuth: Doubles,
        sun: Doubles,
        *,
        steps: int = 64,
        whole: bool = True,
    ) -> Scattered:
        """Light along rays from one place.

        Args:
            radius: of the place.
            mu: of the rays.
            azimuth: of the rays, from the sun's, radians.
            sun: mu of the sun there; the three have shapes that go together.
            steps: of the integration.
            whole: with the light of many scatterings.
        """
        cosine = mu * sun + np.sqrt((1 - mu**2) * np.maximum(1 - sun**2, 0)) * np.cos(azimuth)
        length, _ = ray_length(np.array(radius), mu)
        borders = length[..., None] * np.linspace(0, 1, steps + 1) ** 2
        width = np.diff(borders)
        along = (borders[..., 1:] + borders[..., :-1]) / 2
        there = np.sqrt(radius**2 + along * (along + 2 * radius * mu[..., None]))
        sun_there = np.clip((radius * sun[..., None] + along * cosine[..., None]) / there, -1, 1)
        amounts = np.stack([each.copy() for each in _densities(there - EARTH)]).astype(np.float64)
        # From here on the wavelengths are the first axis, and the steps the last.
        depth = np.einsum("gw,g...->w...", self.depths, amounts * width)
        before = np.cumsum(depth, axis=-1) - depth
        # The light of a step, weakened within the step too.
        reach = np.exp(-before) * np.where(depth > 1e-9, -np.expm1(-depth) / np.maximum(depth, 1e-9), 1.0)
        reach *= width
        each = self.scattering.T.reshape(len(WAVELENGTHS), 2, *[1] * (amounts.ndim - 1)) * amounts[:2]
        each = (each * reach[:, None]).astype(np.float32)
        both = each.sum(axis=1)
        direct = self._sunlight(there, sun_there)
        molecules, aerosol = (_sums(each[:, place], direct) for place in range(2))
        many = _sums(both, self._look_up(there - EARTH, sun_there)) if whole else both.sum(axis=-1)
        through = np.exp(-depth.sum(axis=-1))
        return Scattered(
            *(np.moveaxis(part, 0, -1).astype(np.float64) for part in (molecules, aerosol, many, through))
        )

    def _sunlight(self, radius: Doubles, mu: Doubles) -> Singles:
        """The part of sunlight that arrives in places of the air, shape (wavelengths, ...)."""
        visible = sun_visible(radius, mu)
        lit = visible > 0  # the others are not worth their integrals
        if lit.all():
            return self._left(radius, mu) * visible.astype(np.float32)
        found = np.zeros((len(WAVELENGTHS), *lit.shape), np.float32)
        radii, mus = np.broadcast_to(radius, lit.shape)[lit], np.broadcast_to(mu, lit.shape)[lit]
        found[:, lit] = self._left(radii, mus) * visible[lit].astype(np.float32)
        return found

    def _left(self, radius: Doubles, mu: Doubles) -> Singles:
        """See `transmittance`; shape (wavelengths, ...)."""
        found: Singles = np.einsum("gw,g...->w...", -self.depths.astype(np.float32), _columns(radius, mu))
        np.exp(found, out=found)
        return found

    def _many_at(self, radius: float) -> Doubles:
        """Light of two and more scatterings from any direction, for each sun that is needed: (suns, wavelengths)."""
        count = 48
        place = np.arange(count, dtype=np.float64) + 0.5
        mu: Doubles = 1 - 2 * place / count
        azimuth: Doubles = pi * (1 + 5**0.5) * place  # Fibonacci's points on the sphere
        suns = self._mus[self._needed, None]
        once = self.scattered(radius, mu[None], azimuth[None], suns, steps=24, whole=False)
        second = (once.molecules + once.aerosol) / (4 * pi)
        length, ground = ray_length(np.array(radius), mu)
        # The lit ground, seen through the air.
        cosine = mu * suns + np.sqrt((1 - mu**2) * (1 - suns**2)) * np.cos(azimuth)
        sun_there = np.clip((radius * suns + length * cosine) / EARTH, -1, 1)
        at_ground = np.full_like(sun_there, EARTH)
        light = np.moveaxis(self._sunlight(at_ground, sun_there), 0, -1).astype(np.float64)
        light *= _GROUND / pi * np.maximum(sun_there, 0)[..., None]
        second = (second + np.where(ground[:, None], once.through * light, 0)).mean(axis=1)
        again = once.many.mean(axis=1)  # what of light from everywhere is scattered once more
        found: Doubles = second / (1 - again)
        return found

    def _look_up(self, height: Doubles, mu: Doubles) -> Singles:
        """The table of many scatterings, blended linearly, shape (wavelengths, ...); `height` has no azimuths."""
        row = np.sqrt(np.clip(height.reshape(-1) / self._heights[-1], 0, 1)) * (_LEVELS - 1)
        column = (np.arcsin(mu) / (pi / 2) + 0.5) / 1.5 * (_SUNS - 1)
        column = np.clip(column, 0, _SUNS - 1)
        upper = np.minimum(row.astype(int), _LEVELS - 2)
        left = np.minimum(column.astype(int), _SUNS - 2)
        down, right = (row - upper)[:, None], (column - left).astype(np.float32)
        at_heights = self._many[:, upper] * (1 - down) + self._many[:, upper + 1] * down
        table = at_heights.astype(np.float32).reshape(len(WAVELENGTHS), -1)
        place = left + _SUNS * np.arange(len(row)).reshape(height.shape)
        first, second = np.take(table, place, axis=1), np.take(table, place + 1, axis=1)
        found: Singles = first * (1 - right) + second * right
        return found


def _sums(one: Singles, other: Singles) -> Singles:
    """Of products, over the last axis."""
    found: Singles = np.einsum("...s,...s->...", one, other)
    return found


def rayleigh_depth(micrometres: Doubles) -> Doubles:
    """Vertical optical depth of the air's molecules above the sea."""
    square = micrometres**-2
    return 0.008569 * square**2 * (1 + 0.0113 * square + 0.00013 * square**2)
