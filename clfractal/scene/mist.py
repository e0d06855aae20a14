"""Fog around the set: dense near it, or where orbits take long to escape."""

from math import pi
from typing import Annotated, Literal

from pydantic import Field

from clfractal.schema.base import Amount, Color, Length, Section, problem, rule
from clfractal.schema.stops import IN_ORDER

MAX_STOPS = 6
_USUAL = 0.8
"""The optical thickness of a way straight down to an even surface, of fog whose density nobody has said."""


class MistStop(Section):
    """A colour of the fog; between two stops colours are interpolated in linear light."""

    at: float = Field(
        ge=0, le=1e6, description="distance from the set, scene units; by: iterations - escape count"
    )
    color: Color = Field(description="linear Rec. 709")


class Mist(Section):
    """Fog around the set, with a colour of its own: the part exp(-t) of what is behind it passes, t the integral of its
    density along the eye's ray.

    With d the formula's estimate of the distance to the set the density at a place is density / (1 + ((d - distance) /
    width)^2). `by: iterations` makes it density * s^2, where s goes from 0 at the escape count `start` to 1 at `end`.
    """

    by: Literal["closeness", "iterations"] = Field(
        "closeness",
        description="where it is dense: near the set, or where orbits need many applications to escape",
    )
    density: Amount | None = Field(
        None,
        description="where it is densest, per scene unit; null: a way straight down to an even surface loses about half",
    )
    width: Length | None = Field(
        None,
        description="how far from there it is half as dense, scene units; null: 1/20 of the bounds' radius; with"
        " `by: closeness` only",
    )
    distance: Amount = Field(
        0.0, description="how far from the set it is densest, scene units; with `by: closeness` only"
    )
    start: Amount = Field(
        3.0, description="escape count up to which there is no fog; with `by: iterations` only"
    )
    end: Amount | None = Field(
        None,
        description="escape count from which on it has its whole density; null: the formula's iterations; with"
        " `by: iterations` only",
    )
    colors: Annotated[
        tuple[MistStop, ...], Field(strict=False, min_length=1, max_length=MAX_STOPS), IN_ORDER
    ] = Field(
        ({"at": 0, "color": (0.5, 0.55, 0.6)},),
        validate_default=True,
        description="stops in order of `at`",
    )

    @rule
    def _grows(self) -> None:
        if self.by == "iterations" and self.end is not None and self.end <= self.start:
            raise problem(f"must be above start, {self.start:g}, got {self.end:g}", "end")

    def used_width(self, radius: float) -> float:
        """Its width in scene units, for bounds of a radius."""
        return self.width if self.width is not None and self.by == "closeness" else radius / 20

    def used_density(self, radius: float) -> float:
        """Its density per scene unit, likewise."""
        return self.density if self.density is not None else _USUAL / (pi / 2 * self.used_width(radius))

    def used_end(self, iterations: int) -> float:
        """The escape count from which on it has its whole density, for a formula's iterations."""
        return self.end if self.end is not None else max(float(iterations), self.start + 1)
