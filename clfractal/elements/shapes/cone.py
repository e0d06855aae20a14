"""A cone as an object."""

from math import hypot
from typing import Annotated, Any, Literal

from pydantic import Field

from clfractal.schema.base import Amount, Length, Vector
from clfractal.schema.fields import SCALE
from clfractal.schema.shape import Solid


class ConeObject(Solid):
    """A cone with a tip, or with lids at both ends; its axis is z before it is rotated."""

    place = 55
    type: Literal["cone"] = "cone"
    radius: Annotated[Length, SCALE] = Field(0.4, description="of its lower lid, scene units")
    top: Amount = Field(0.0, description="radius of its upper lid, scene units; 0: a tip")
    height: Annotated[Length, SCALE] = Field(1.0, description="from end to end, scene units")

    @classmethod
    def first(cls, radius: float) -> dict[str, Any]:
        """As of every solid."""
        return {"radius": 0.6 * radius, "height": 1.6 * radius}

    @property
    def half_sides(self) -> Vector:
        """As of every solid."""
        wide = max(self.radius, self.top)
        return (wide, wide, self.height / 2)

    @property
    def form(self) -> Vector:
        """The radii of both lids, lower and upper, over the larger one."""
        wide = max(self.radius, self.top)
        return (self.radius / wide, self.top / wide, 0.0)

    def holds(self, point: Vector) -> bool:
        """Whether a point is inside."""
        x, y, z = self.own_place(point)
        lower, upper, _ = self.form
        return abs(z) < 1 and hypot(x, y) < ((1 - z) * lower + (1 + z) * upper) / 2
