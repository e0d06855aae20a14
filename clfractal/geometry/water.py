"""The waves of water: a sum of many, each along a straight line (`kernels/geometry/water.h`)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from random import Random

import numpy as np
import numpy.typing as npt

from clfractal.scene.objects import WaterObject, Waves
from clfractal.schema.base import dot, frame_of

WAVES = 16
"""Waves of water."""
# Of the length that the scene gives: the longest wave's, and the shortest one's.
_LONGEST, _SHORTEST = 1.5, 0.12
# How heights grow with length: longer waves are a little steeper.
_GROWTH = 1.15
# What a second harmonic may be without another crest in each trough.
_MOST_SHARP = 0.25
GRAVITY = 9.81

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WaveSet:
    """Waves as sums of a (cos p + s cos 2p) with p = x u + y v + phase at the place (u, v) of the plane.

    The second harmonic is that of Stokes (1847), by which crests are sharper than troughs.

    Attributes:
        x: their changes of phase along the plane's side, radians by scene unit.
        y: the same along its other side.
        height: a, scene units.
        phase: radians.
        sharp: s.
    """

    x: Floats
    y: Floats
    height: Floats
    phase: Floats
    sharp: float

    @property
    def reach(self) -> float:
        """No place is higher or deeper, scene units."""
        return float(self.height.sum() * (1 + self.sharp))

    @property
    def slope(self) -> float:
        """No place is steeper: rise by way."""
        return float((self.height * np.hypot(self.x, self.y)).sum() * (1 + 2 * self.sharp))


def wave_set(water: WaterObject) -> WaveSet:
    """The waves of water in its `frame_of`. Their significant height is four standard deviations of a place's height."""
    waves: Waves = water.waves
    side, up, _ = frame_of(water.normal)
    main = math.atan2(dot(waves.direction, up), dot(waves.direction, side))
    random = Random(waves.seed)
    shares = (np.arange(WAVES) + np.array([random.random() for _ in range(WAVES)])) / WAVES
    lengths = waves.length * _LONGEST * (_SHORTEST / _LONGEST) ** shares
    angles = main + np.radians(waves.spread) * np.array([random.gauss(0, 1) for _ in range(WAVES)])
    starts = 2 * np.pi * np.array([random.random() for _ in range(WAVES)])
    numbers, sharp = 2 * np.pi / lengths, _MOST_SHARP * waves.choppiness
    heights = lengths**_GROWTH
    heights *= waves.height / 4 / math.sqrt((heights**2).sum() / 2 * (1 + sharp**2))
    phases = np.mod(starts - np.sqrt(GRAVITY * numbers) * waves.time, 2 * np.pi)
    return WaveSet(numbers * np.cos(angles), numbers * np.sin(angles), heights, phases, sharp)
