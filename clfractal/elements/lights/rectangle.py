"""A rectangle that shines."""

from math import pi
from typing import Any, Literal

from pydantic import Field

from clfractal.schema.base import Direction, Length, Position, Vector, cross, length, problem, rule, unit
from clfractal.schema.light import AXIS, SingleLight
from clfractal.schema.record import Number


class RectangleLight(SingleLight):
    """A rectangle that shines on one side; `intensity` times the colour is the radiance that it shows."""

    title = "Area"
    about = "of a rectangle"
    place = 50
    is_seen = True
    numbers = (
        AXIS,
        Number("side", "real", 3, "a rectangle's middle to its right rim, scene units"),
        Number("upward", "real", 3, "the same, to its upper rim"),
        Number("area", "real", 0, "of a rectangle, square scene units"),
    )
    type: Literal["rectangle"] = "rectangle"
    position: Position = Field(description="its middle, scene units")
    direction: Direction = Field((0.0, 0.0, -1.0), description="where its shining side looks to")
    up: Direction = Field((0.0, 1.0, 0.0), description="about along its height; not along `direction`")
    width: Length = Field(1.0, description="scene units")
    height: Length = Field(1.0, description="scene units")
    visible: bool = Field(True, description="whether the eye sees it; mirrors and paths of light always do")

    @rule
    def _has_a_frame(self) -> None:
        if length(cross(unit(self.direction), unit(self.up))) < 1e-6:
            raise problem("must not be along direction", "up")

    @classmethod
    def first(cls, away: float) -> dict[str, Any]:
        """As of every light."""
        return {"width": 0.6 * away, "height": 0.6 * away}

    def given(self, away: float) -> float:
        """As of every light."""
        return min(self.width * self.height / (pi * away**2), 1.0)

    @property
    def frame(self) -> tuple[Vector, Vector]:
        """Directions of its width and of its height, length 1."""
        side = unit(cross(self.direction, self.up))
        return side, unit(cross(side, self.direction))

    @property
    def extent(self) -> Vector:
        """As of every light."""
        side, upward = self.frame
        x, y, z = (
            abs(a) * self.width / 2 + abs(b) * self.height / 2 for a, b in zip(side, upward, strict=True)
        )
        return x, y, z

    @property
    def beam(self) -> tuple[Vector, float, float]:
        """As of every light."""
        return self.direction, 0.0, pi / 2

    def packed(self) -> dict[str, object]:
        """As of every light."""
        side, upward = self.frame
        return {
            **super().packed(),
            "axis": unit(self.direction),
            "side": tuple(each * self.width / 2 for each in side),
            "upward": tuple(each * self.height / 2 for each in upward),
            "area": self.width * self.height,
            "visible": int(self.visible),
        }
