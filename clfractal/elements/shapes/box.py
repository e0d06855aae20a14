"""A box as an object."""

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from clfractal.schema.base import Vector
from clfractal.schema.fields import SCALE
from clfractal.schema.shape import Sides, Solid

if TYPE_CHECKING:
    from clfractal.schema.shape import Floats


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

    def away(self, points: "Floats") -> "Floats":
        """As of every shape."""
        import numpy as np

        own, long = self.own_places(points)
        return np.asarray((np.abs(own) - long).max(axis=1))
