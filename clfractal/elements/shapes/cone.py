"""A cone as an object."""

from math import hypot
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from clfractal.schema.base import Amount, Length, Vector
from clfractal.schema.fields import SCALE
from clfractal.schema.shape import Solid, from_surface

if TYPE_CHECKING:
    from clfractal.schema.shape import Floats


class ConeObject(Solid):
    """A cone with a tip, or with lids at both ends; its axis is z before it is rotated."""

    place = 55
    rounded = 2
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

    def away(self, points: "Floats") -> "Floats":
        """As of every shape."""
        import numpy as np

        own, long = self.own_places(points)
        x, y, z = (own / long).T
        lower, upper, _ = self.form
        out, wide, lean = np.hypot(x, y), long[:2].min(), (lower - upper) / 2 / long[2]
        near = np.maximum(out, 1e-300)
        slopes = (x / near / long[0], y / near / long[1])
        # Its side leans: a step out of it is longer than the way to it. Beyond its rims the cylinder around it is nearer.
        radius = ((1 - z) * lower + (1 + z) * upper) / 2
        side = np.maximum(
            from_surface(out - radius, (*slopes, np.full_like(z, lean)), np.hypot(1 / wide, lean)),
            from_surface(out - 1, slopes, 1 / wide),
        )
        return np.asarray(np.maximum(side, np.abs(own[:, 2]) - long[2]))
