"""Light around the set, by how near rays pass it."""

from typing import Literal

from pydantic import Field

from clfractal.schema.base import Amount, Color, Length, Section
from clfractal.schema.trap import Trap


class Glow(Section):
    """Light that a ray gathers near the set: intensity / width times the integral of exp(-d / width) along it.

    d is the formula's estimate of the distance to the set. `by: trap` multiplies what is added by exp(-q / reach),
    where q is the smallest distance of the place's orbit from the trap.
    """

    color: Color = Field((1.0, 0.6, 0.25), description="linear Rec. 709")
    intensity: Amount = Field(
        0.3,
        description="what a ray that goes straight down to an even surface gathers in all, times the colour",
    )
    width: Length | None = Field(
        None,
        description="distance over which it fades to 1/e, about a third, scene units; null: 1/20 of the bounds' radius",
    )
    by: Literal["closeness", "trap"] = Field(
        "closeness",
        description="where it is: all around the set, or near it where the orbit comes near a shape",
    )
    reach: Length = Field(
        0.2, description="distance from the shape over which it fades to 1/e; with `by: trap` only"
    )
    trap: Trap = Field(default_factory=dict, validate_default=True, description="the shape for `by: trap`")

    def used_width(self, radius: float) -> float:
        """Its width in scene units, for bounds of a radius."""
        return self.width if self.width is not None else radius / 20
