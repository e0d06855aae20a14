"""A cylinder as an object."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from clfractal.schema.base import Length, Vector
from clfractal.schema.fields import SCALE
from clfractal.schema.shape import Solid, from_surface

if TYPE_CHECKING:
    from clfractal.schema.shape import Floats


class CylinderObject(Solid):
    """A cylinder with lids; its axis is z before it is rotated."""

    place = 50
    rounded = 2
    type: Literal["cylinder"] = "cylinder"
    radius: Annotated[Length, SCALE] = Field(0.25, description="scene units")
    height: Annotated[Length, SCALE] = Field(1.0, description="from lid to lid, scene units")

    @classmethod
    def first(cls, radius: float) -> dict[str, Any]:
        """As of every solid."""
        return {"radius": 0.45 * radius, "height": 1.78 * radius}

    @property
    def half_sides(self) -> Vector:
        """As of every solid."""
        return (self.radius, self.radius, self.height / 2)

    def holds(self, point: Vector) -> bool:
        """Whether a point is inside."""
        x, y, z = self.own_place(point)
        return x * x + y * y < 1 and abs(z) < 1

    def away(self, points: "Floats") -> "Floats":
        """As of every shape."""
        import numpy as np

        own, long = self.own_places(points)
        x, y = (own[:, :2] / long[:2]).T
        out = np.hypot(x, y)
        near = np.maximum(out, 1e-300)
        around = from_surface(out - 1, (x / near / long[0], y / near / long[1]), 1 / long[:2].min())
        return np.asarray(np.maximum(around, np.abs(own[:, 2]) - long[2]))
