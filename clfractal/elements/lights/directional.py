"""A light that is infinitely far away."""

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field

from clfractal.schema.base import Direction
from clfractal.schema.light import SmallLight


class DirectionalLight(SmallLight):
    """Light from infinitely far away."""

    title = "Sun"
    about = "from infinitely far away"
    place = 10
    type: Literal["directional"] = "directional"
    direction: Direction = Field((-1.0, 1.0, -1.0), description="direction in which the light travels")

    def controls(self, radius: float) -> Mapping[str, Mapping[str, Any]]:
        """As of every light."""
        return {"direction": {"step": 0.01}}

    def packed(self) -> dict[str, object]:
        """As of every light."""
        return {**super().packed(), "vector": self.direction}
