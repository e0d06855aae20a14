"""Orbit traps, of colours, glow and lights."""

from typing import Literal, Self

from pydantic import Field, model_validator

from clfractal.schema.base import Direction, Length, Position, Section, length, problem


class Trap(Section):
    """A shape in the formula's space; the colour follows the smallest distance of the orbit from it."""

    shape: Literal["point", "axis", "plane", "sphere"] = Field(
        "point", description="the shape to which the orbit's distance is measured"
    )
    center: Position = Field(
        (0.0, 0.0, 0.0), description="the point, a point of the axis or plane, or the sphere's centre"
    )
    direction: Direction = Field((0.0, 0.0, 1.0), description="the axis's direction, or the plane's normal")
    radius: Length = Field(1.0, description="the sphere's radius")

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Self:
        if length(self.direction) < 1e-12:
            raise problem("must not be zero", "direction")
        return self
