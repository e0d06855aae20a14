"""A box as an object."""

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from clfractal.schema.base import Vector
from clfractal.schema.fields import SCALE
from clfractal.schema.shape import Sides, Solid


class BoxObject(Solid):
    """A box."""

    place = 40
    type: Literal["box"] = "box"
    size: Annotated[Sides, SCALE] = Field((1.0, 1.0, 1.0), description="its sides, scene units")

    @classmethod
    def first(cls, radius: float) -> dict[str, Any]:
        """As of every solid; its corners are on the ball."""
        return {"size": [2 * radius / math.sqrt(3)] * 3}

    @property
    def half_sides(self) -> Vector:
        """As of every solid."""
        x, y, z = self.size
        return (x / 2, y / 2, z / 2)

    def holds(self, point: Vector) -> bool:
        """Whether a point is inside."""
        return max(abs(x) for x in self.own_place(point)) < 1
