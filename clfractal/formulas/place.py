"""Where a scene's space lies in its formula's: a place of any depth, and how much it is magnified."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property


@dataclass(frozen=True)
class Place:
    """The point p of the scene is the point `center` + p / `magnification` of the formula's own space.

    Attributes:
        center: three decimal numbers, as text of any number of digits.
        magnification: how many times larger things are in the scene; above 0.
        applications: the most that orbits have: no orbit begins behind them.
    """

    center: tuple[str, str, str]
    magnification: float
    applications: int

    @cached_property
    def exact(self) -> tuple[Fraction, Fraction, Fraction]:
        """The centre."""
        x, y, z = map(Fraction, self.center)
        return x, y, z

    @property
    def scale(self) -> float:
        """One unit of the scene in the formula's space."""
        return 1 / self.magnification

    @property
    def near(self) -> tuple[float, float, float]:
        """The centre, rounded."""
        x, y, z = map(float, self.exact)
        return x, y, z

    def seen(self, point: Sequence[float | Fraction]) -> tuple[float, float, float]:
        """A point of the formula's space in the scene, rounded once."""
        factor = Fraction(self.magnification)
        x, y, z = (float((Fraction(a) - b) * factor) for a, b in zip(point, self.exact, strict=True))
        return x, y, z
