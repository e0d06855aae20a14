"""A ball as an object."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from clfractal.schema.base import Length, Vector, length
from clfractal.schema.fields import SCALE
from clfractal.schema.shape import Solid, from_surface

if TYPE_CHECKING:
    from clfractal.schema.shape import Floats


class SphereObject(Solid):
    """A ball, or with `scale` an ellipsoid."""

    place = 30
    rounded = 3
    type: Literal["sphere"] = "sphere"
    radius: Annotated[Length, SCALE] = Field(0.5, description="scene units")

    @classmethod
    def first(cls, radius: float) -> dict[str, Any]:
        """As of every solid."""
        return {"radius": radius}

    @property
    def half_sides(self) -> Vector:
        """As of every solid."""
        return (self.radius, self.radius, self.radius)

    def holds(self, point: Vector) -> bool:
        """Whether a point is inside."""
        return length(self.own_place(point)) < 1

    def away(self, points: "Floats") -> "Floats":
        """As of every shape."""
        import numpy as np

        own, long = self.own_places(points)
        out = np.linalg.norm(own / long, axis=1)
        slopes = (own / long**2).T / np.maximum(out, 1e-300)
        return from_surface(out - 1, list(slopes), 1 / long.min())
