"""A light at a point."""

from typing import Literal

from pydantic import Field

from clfractal.schema.base import Position
from clfractal.schema.light import SmallLight


class PointLight(SmallLight):
    """Light from a point, which shines in all directions."""

    about = "from a point"
    place = 20
    type: Literal["point"] = "point"
    position: Position = Field(description="scene units")
    falloff: Literal["none", "inverse_square"] = Field(
        "none",
        description="how the light weakens with distance; with `inverse_square`, `intensity` is what arrives at a"
        " distance of 1",
    )

    def given(self, away: float) -> float:
        """As of every light."""
        return 1.0 if self.falloff == "none" else 1 / away**2

    @property
    def weakens(self) -> bool:
        """As of every light."""
        return self.falloff != "none"

    def packed(self) -> dict[str, object]:
        """As of every light."""
        return {**super().packed(), "inverse_square": int(self.falloff == "inverse_square")}
