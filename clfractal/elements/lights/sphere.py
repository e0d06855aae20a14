"""A ball that shines."""

from typing import Any, Literal

from pydantic import Field

from clfractal.schema.base import Length, Position, Vector
from clfractal.schema.light import SingleLight
from clfractal.schema.record import Number


class SphereLight(SingleLight):
    """A ball that shines evenly; `intensity` times the colour is the radiance that it shows."""

    title = "Ball"
    about = "of a ball"
    place = 40
    is_seen = True
    numbers = (Number("radius", "real", 0, "of a sphere, scene units"),)
    type: Literal["sphere"] = "sphere"
    position: Position = Field(description="its centre, scene units")
    radius: Length = Field(0.1, description="scene units")
    visible: bool = Field(True, description="whether the eye sees it; mirrors and paths of light always do")

    @classmethod
    def first(cls, away: float) -> dict[str, Any]:
        """As of every light."""
        return {"radius": 0.1 * away}

    def given(self, away: float) -> float:
        """As of every light."""
        return min(self.radius / away, 1.0) ** 2

    @property
    def extent(self) -> Vector:
        """As of every light."""
        return (self.radius,) * 3

    def packed(self) -> dict[str, object]:
        """As of every light."""
        return {**super().packed(), "radius": self.radius, "visible": int(self.visible)}
