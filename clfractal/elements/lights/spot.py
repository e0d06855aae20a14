"""A light at a point that shines into a cone."""

from math import pi, radians
from typing import Any, Literal

from pydantic import Field

from clfractal.schema.base import Direction, Fraction, Position, Vector, unit
from clfractal.schema.light import AXIS, SmallLight
from clfractal.schema.record import Number


class SpotLight(SmallLight):
    """Light from a point into a cone."""

    about = "in a cone"
    place = 30
    numbers = (
        AXIS,
        Number(
            "rim", "real", 2, "of a spot: half angles where it is dark, and where it begins to fade, radians"
        ),
    )
    type: Literal["spot"] = "spot"
    position: Position = Field(description="scene units")
    falloff: Literal["none", "inverse_square"] = Field(
        "inverse_square", description="how the light weakens with distance"
    )
    direction: Direction = Field(
        (0.0, 0.0, -1.0), description="axis of the cone, along which the light travels"
    )
    angle: float = Field(40.0, gt=0, le=180, description="full angle of the cone, degrees")
    softness: Fraction = Field(
        0.2, description="part of the cone's half angle over which the light fades at its rim; 0: a sharp rim"
    )

    @classmethod
    def first(cls, away: float) -> dict[str, Any]:
        """As of every light."""
        return {"angle": 60.0}

    def given(self, away: float) -> float:
        """As of every light."""
        return 1.0 if self.falloff == "none" else 1 / away**2

    @property
    def weakens(self) -> bool:
        """As of every light."""
        return self.falloff != "none"

    @property
    def beam(self) -> tuple[Vector, float, float]:
        """As of every light; a little more, for what is rounded."""
        return self.direction, min(radians(self.angle) / 2 + 1e-3, pi), 1e-2

    def packed(self) -> dict[str, object]:
        """As of every light."""
        half = radians(self.angle) / 2
        return {
            **super().packed(),
            "inverse_square": int(self.falloff == "inverse_square"),
            "axis": unit(self.direction),
            "rim": (half, half * (1 - self.softness)),
        }
