"""How coarse a moving picture is, and when a growing one is shown: so that frames come at the wanted rate."""

from __future__ import annotations

import math
from dataclasses import dataclass

from clfractal.engine.carry import RENDERED

SHOWN_AFTER = (0.1, 0.25, 0.5, 1.0, 2.0)
"""Seconds after the start of a picture at rest when it is shown anew; later every two seconds."""

_USUAL = 4e-7
"""Seconds a pixel takes, before anything is known."""
_CARRYING = 2e-8
"""Seconds in which a pixel is carried over from the picture before, before anything is known."""
_SHOWING = 0.4
"""Part of a frame's time that is left for showing it, and for everything else."""


@dataclass(slots=True)
class Pacing:
    """Chooses how many pixels one ray stands for, from what earlier frames took.

    Attributes:
        rate: frames a second that are wanted.
        coarsest: the largest divider that is allowed; 1: never coarse.
        seconds_per_pixel: that kernels took for the frames so far.
        seconds_per_carried: that carrying a pixel over took.
        fixed: seconds of a frame that do not depend on its pixels.
    """

    rate: float = 30.0
    coarsest: int = 16
    seconds_per_pixel: float = _USUAL
    fixed: float = 0.003
    seconds_per_carried: float = _CARRYING

    def divider(self, pixels: int, *, carries: bool = False) -> int:
        """Of how many pixels, in each direction, a moving picture of `pixels` pixels has one.

        Args:
            carries: whether only a part of these is rendered, and the others are carried over from the picture before.
        """
        room = max((1 - _SHOWING) / self.rate - self.fixed, 0.2 / self.rate)
        each = self.seconds_per_pixel
        if carries:
            each = RENDERED * each + self.seconds_per_carried
        wanted = math.ceil(math.sqrt(max(pixels * each / room, 1e-9)))
        return max(1, min(wanted, self.coarsest))

    def learn_carrying(self, pixels: int, seconds: float) -> None:
        """Takes note of what it took to carry a picture of so many pixels over, beside the kernels that rendered a part."""
        self.seconds_per_carried += 0.3 * (seconds / max(pixels, 1) - self.seconds_per_carried)

    def learn(self, pixels: int, kernel: float, seconds: float) -> None:
        """Takes note of what a frame of so many rendered pixels took: the kernels, and all of it."""
        self.fixed += 0.2 * (min(max(seconds - kernel, 0.0), 0.05) - self.fixed)
        found = kernel / max(pixels, 1)
        # Slower at once, faster by and by: a frame that comes too late is worse than one that is too coarse.
        share = 0.7 if found > self.seconds_per_pixel else 0.3
        self.seconds_per_pixel += share * (found - self.seconds_per_pixel)

    def estimate(self, pixels: int) -> float:
        """Seconds that one sample of so many pixels will take."""
        return self.fixed + pixels * self.seconds_per_pixel


class Schedule:
    """When a picture at rest is shown anew."""

    def __init__(self, now: float) -> None:
        self._start = now
        self._shown = 0

    def due(self, now: float) -> bool:
        """Whether it is time, which is then over."""
        passed = now - self._start
        times = sum(passed >= after for after in SHOWN_AFTER)
        if passed >= SHOWN_AFTER[-1]:
            times += int((passed - SHOWN_AFTER[-1]) / 2.0)
        if times <= self._shown:
            return False
        self._shown = times
        return True
