"""The sun of a sky as a disc: where it is, and what the air leaves of its light.

Its radiance falls towards the limb as the cosine, under which its surface is seen, to a power that depends on the
wavelength (Hestroffer and Magnan, Wavelength dependency of the Solar limb darkening, Astronomy and Astrophysics 333,
1998). In all the disc brings as much light as an even one. Where it is low the air leaves more of its upper rim than of
its lower one: exponentially, as a polynomial of the height.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, radians, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np

from clfractal.scene.atmosphere import EARTH, SUN_RADIUS, Atmosphere, Doubles
from clfractal.scene.grid_place import vector_of
from clfractal.scene.sky import EYE, to_rgb
from clfractal.schema.base import Vector

if TYPE_CHECKING:
    from clfractal.scene.lighting import Sky

LIMB: Vector = (0.456, 0.508, 0.605)
"""Exponents -0.023 + 0.292 / wavelength in micrometres, at 610, 550 and 465 nm."""
SPREAD = 2 * sin(SUN_RADIUS / 2) ** 2
"""1 - cos of its radius."""
SOLID_ANGLE = 2 * pi * SPREAD
"""Of the disc, steradians."""

_PLACES = 65  # of heights in the disc, of its rings, and around each
_CHORD = 2 * sin(SUN_RADIUS / 2)  # from its middle to its rim


@dataclass(frozen=True, slots=True)
class Sun:
    """A disc of the radius SUN_RADIUS: in a direction at the distance q from its middle, in radii, and h radii higher, its
    radiance is light * (1 - q^2)^(limb / 2) * exp(fade * h + bend * h^2), and 0 where the direction's z is below `horizon`.

    Attributes:
        toward: its middle, length 1, in the directions of maps.
        light: linear Rec. 709, as `fade` and `bend` are.
        irradiance: what all of it brings to a surface that faces it, linear Rec. 709.
    """

    toward: Vector
    light: Vector
    fade: Vector
    bend: Vector
    horizon: float
    irradiance: Vector

    def radiance(self, directions: Doubles) -> Doubles:
        """What directions of length 1 show of it, shape (..., 3) as they have."""
        apart = directions - np.array(self.toward)
        square = (apart**2).sum(axis=-1) / (2 * SPREAD)
        seen = (square < 1) & (directions[..., 2] > self.horizon)
        height = np.where(seen, apart[..., 2] / _CHORD, 0)[..., None]
        limb = np.where(seen, 1 - square, 0)[..., None] ** (np.array(LIMB) / 2)
        found: Doubles = (
            np.array(self.light) * limb * np.exp(height * (self.fade + height * np.array(self.bend)))
        )
        return found


@lru_cache(maxsize=4)
def sun_of(sky: Sky) -> Sun | None:
    """The sun of a sky; None where the sky has none."""
    if not sky.sun:
        return None
    elevation, azimuth = radians(sky.sun_elevation), radians(sky.sun_azimuth)
    level, middle = cos(elevation), sin(elevation)
    horizon = -sqrt(1 - (EARTH / EYE) ** 2)
    heights = np.linspace(-1, 1, _PLACES)
    mu = np.clip(middle + _CHORD * heights, -1, 1)
    air = Atmosphere(sky.turbidity)
    left = np.maximum(to_rgb(air.transmittance(np.full_like(mu, EYE), mu)), 0) / SOLID_ANGLE
    fade, bend = _fitted(heights, left)
    # What comes from the disc: rings of equal area, and places around each.
    square = ((np.arange(_PLACES) + 0.5) / _PLACES)[:, None]
    around = np.cos((np.arange(_PLACES) + 0.5) / _PLACES * pi)
    drop = square * SPREAD
    height = (level * around * np.sqrt(drop * (2 - drop)) - middle * drop) / _CHORD
    seen = (middle + _CHORD * height > horizon)[..., None]
    limb = (1 - square)[..., None] ** (np.array(LIMB) / 2)
    edge = limb.mean(axis=(0, 1))
    limb = limb / edge * seen
    exact = np.stack([np.interp(height, heights, each) for each in left.T], axis=-1)
    irradiance = (exact * limb).mean(axis=(0, 1)) * SOLID_ANGLE
    shape = np.exp(height[..., None] * (fade + height[..., None] * bend)) * limb
    light = irradiance / np.maximum(shape.mean(axis=(0, 1)) * SOLID_ANGLE, 1e-30) / edge
    toward = (level * sin(azimuth), level * cos(azimuth), middle)
    return Sun(toward, vector_of(light), vector_of(fade), vector_of(bend), horizon, vector_of(irradiance))


def _fitted(heights: Doubles, light: Doubles) -> tuple[Doubles, Doubles]:
    """The slopes and bends of logarithms, by least squares that weigh each place by its light; of black ones 0."""
    found = np.zeros((2, 3))
    for channel, values in enumerate(light.T):
        lit = values > 1e-4 * values.max()
        if lit.sum() > 2:
            bend, slope, _ = np.polyfit(heights[lit], np.log(values[lit]), 2, w=values[lit] / values.max())
            found[:, channel] = slope, bend
    return found[0], found[1]
