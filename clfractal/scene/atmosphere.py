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

from dataclasses import dataclass
from functools import cached_property
from math import exp, pi

import numpy as np
import numpy.typing as npt

Doubles = npt.NDArray[np.float64]

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
_LEVELS, _SUNS = 16, 40  # the table of many scatterings


def rayleigh_phase(cosine: Doubles) -> Doubles:
    """Per steradian."""
    found: Doubles = 3 / (16 * pi) * (1 + cosine**2)
    return found


def aerosol_phase(cosine: Doubles) -> Doubles:
    """Per steradian: Cornette and Shanks, Applied Optics 31 (1992)."""
    g = _FORWARD
    below: Doubles = (2 + g * g) * (1 + g * g - 2 * g * cosine) ** 1.5
    found: Doubles = 3 / (8 * pi) * (1 - g * g) * (1 + cosine**2) / below
    return found


def densities(height: Doubles) -> Doubles:
    """Of molecules, aerosol and ozone, each as a part of its whole column, per km; shape (..., 3)."""
    return np.stack(_densities(height), axis=-1).astype(np.float64)


def columns(radius: Doubles, mu: Doubles) -> Doubles:
    """How much of each lies on a ray to the air's end, 1 being the whole vertical column; shape (..., 3).

    The ground does not end the ray.
    """
    length = _to_sphere(radius, mu, TOP)[..., None]
    part = (_NODES + 1) / 2
    along = length * part**2  # more points where the air is dense
    height = np.sqrt(radius[..., None] ** 2 + along * (along + 2 * (radius * mu)[..., None])) - EARTH
    widths = (length * part * _WEIGHTS).astype(np.float32)
    sums = [np.einsum("...n,...n->...", widths, each) for each in _densities(height)]
    return np.stack(sums, axis=-1).astype(np.float64)


def _densities(height: Doubles) -> list[npt.NDArray[np.float32]]:
    """Of each gas. Once the height is known float32 is enough, and takes a quarter of the time."""
    above = np.maximum(height, 0.0).astype(np.float32)
    found: list[npt.NDArray[np.float32]] = []
    for scale in (_MOLECULES, _AEROSOL):
        column = scale * (1 - exp(-(TOP - EARTH) / scale))
        found.append(np.exp(above * np.float32(-1 / scale)) * np.float32(1 / column))
    tent = 1 - np.abs(above - np.float32(_OZONE_HEIGHT)) * np.float32(1 / _OZONE_REACH)
    return [*found, np.maximum(tent, np.float32(0)) * np.float32(1 / _OZONE_REACH)]


def sun_visible(radius: Doubles, mu: Doubles) -> Doubles:
    """Which part of the sun stands above the horizon, its middle being at `mu`: about, 0 to 1."""
    dip = np.arccos(np.minimum(EARTH / radius, 1.0))
    part = np.clip((np.arcsin(np.clip(mu, -1, 1)) + dip) / (2 * SUN_RADIUS) + 0.5, 0, 1)
    found: Doubles = part * part * (3 - 2 * part)
    return found


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
    """Air of a turbidity, at least 1."""

    def __init__(self, turbidity: float) -> None:
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
        self._mus: Doubles = np.sin(pi / 2 * np.linspace(-0.5, 1, _SUNS))

    @cached_property
    def _many(self) -> Doubles:
        """The light of many scatterings at heights and for suns."""
        return np.stack([self._many_at(EARTH + height) for height in self._heights])

    def transmittance(self, radius: Doubles, mu: Doubles) -> Doubles:
        """The part of light from outside the air that arrives, without regard to the ground: Beer and Lambert's law."""
        found: Doubles = np.exp(-columns(radius, mu) @ self.depths)
        return found

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
        amounts = densities(there - EARTH)
        depth = (amounts * width[..., None]) @ self.depths
        before = np.cumsum(depth, axis=-2) - depth
        # The light of a step, weakened within the step too.
        reach = np.exp(-before) * np.where(depth > 1e-9, -np.expm1(-depth) / np.maximum(depth, 1e-9), 1.0)
        reach *= width[..., None]
        direct = reach * self.transmittance(there, sun_there) * sun_visible(there, sun_there)[..., None]
        molecules = np.einsum("...s,...sw->...w", amounts[..., 0], direct) * self.scattering[0]
        aerosol = np.einsum("...s,...sw->...w", amounts[..., 1], direct) * self.scattering[1]
        both = amounts[..., :2] @ self.scattering
        many = (both * reach * self._look_up(there - EARTH, sun_there) if whole else both * reach).sum(
            axis=-2
        )
        return Scattered(molecules, aerosol, many, np.exp(-depth.sum(axis=-2)))

    def _many_at(self, radius: float) -> Doubles:
        """Light of two and more scatterings from any direction, for each sun of the table: (suns, wavelengths)."""
        count = 48
        place = np.arange(count, dtype=np.float64) + 0.5
        mu: Doubles = 1 - 2 * place / count
        azimuth: Doubles = pi * (1 + 5**0.5) * place  # Fibonacci's points on the sphere
        suns = self._mus[:, None]
        once = self.scattered(radius, mu[None], azimuth[None], suns, steps=24, whole=False)
        second = (once.molecules + once.aerosol) / (4 * pi)
        length, ground = ray_length(np.array(radius), mu)
        # The lit ground, seen through the air.
        cosine = mu * suns + np.sqrt((1 - mu**2) * (1 - suns**2)) * np.cos(azimuth)
        sun_there = np.clip((radius * suns + length * cosine) / EARTH, -1, 1)
        at_ground = np.full_like(sun_there, EARTH)
        light = self.transmittance(at_ground, sun_there) * sun_visible(at_ground, sun_there)[..., None]
        light *= _GROUND / pi * np.maximum(sun_there, 0)[..., None]
        second = (second + np.where(ground[:, None], once.through * light, 0)).mean(axis=1)
        again = once.many.mean(axis=1)  # what of light from everywhere is scattered once more
        found: Doubles = second / (1 - again)
        return found

    def _look_up(self, height: Doubles, mu: Doubles) -> Doubles:
        """The table of many scatterings, blended linearly."""
        row = np.sqrt(np.clip(height / self._heights[-1], 0, 1)) * (_LEVELS - 1)
        column = (np.arcsin(mu) / (pi / 2) + 0.5) / 1.5 * (_SUNS - 1)
        column = np.clip(column, 0, _SUNS - 1)
        upper = np.minimum(row.astype(int), _LEVELS - 2)
        left = np.minimum(column.astype(int), _SUNS - 2)
        down, right = (row - upper)[..., None], (column - left)[..., None]
        table = self._many
        first = table[upper, left] * (1 - right) + table[upper, left + 1] * right
        second = table[upper + 1, left] * (1 - right) + table[upper + 1, left + 1] * right
        found: Doubles = first * (1 - down) + second * down
        return found


def rayleigh_depth(micrometres: Doubles) -> Doubles:
    """Vertical optical depth of the air's molecules above the sea."""
    square = micrometres**-2
    found: Doubles = 0.008569 * square**2 * (1 + 0.0113 * square + 0.00013 * square**2)
    return found
