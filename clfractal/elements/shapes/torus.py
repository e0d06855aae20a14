"""A torus as an object."""

from math import hypot
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field

from clfractal.schema.base import Length, Vector, problem, rule
from clfractal.schema.fields import SCALE
from clfractal.schema.shape import Solid, from_surface

if TYPE_CHECKING:
    from clfractal.schema.shape import Floats


class TorusObject(Solid):
    """A torus, as a ring or a tyre; it lies around the z axis before it is rotated."""

    place = 60
    rounded = 2
    spans = 2
    type: Literal["torus"] = "torus"
    radius: Annotated[Length, SCALE] = Field(
        0.5, description="of its ring, to the middle of the tube, scene units"
    )
    tube: Annotated[Length, SCALE] = Field(
        0.15, description="radius of its tube, at most `radius`, scene units"
    )

    @rule
    def _has_a_ring(self) -> None:
        if self.tube > self.radius:
            raise problem(f"must be at most the ring's radius, {self.radius:g}, got {self.tube:g}", "tube")

    @classmethod
    def first(cls, radius: float) -> dict[str, Any]:
        """As of every solid."""
        return {"radius": 0.76 * radius, "tube": 0.23 * radius}

    @property
    def half_sides(self) -> Vector:
        """As of every solid."""
        return (self.radius + self.tube, self.radius + self.tube, self.tube)

    @property
    def form(self) -> Vector:
        """The radii of ring and tube, over the distance from its middle to its rim."""
        rim = self.radius + self.tube
        return (self.radius / rim, self.tube / rim, 0.0)

    def holds(self, point: Vector) -> bool:
        """Whether a point is inside."""
        x, y, z = self.own_place(point)
        ring, tube, _ = self.form
        return (hypot(x, y) - ring) ** 2 + (tube * z) ** 2 < tube**2

    def away(self, points: "Floats") -> "Floats":
        """As of every shape."""
        import numpy as np

        own, long = self.own_places(points)
        x, y, z = (own / long).T
        ring, tube, _ = self.form
        # (In units of the distance from its middle to its rim, in which its tube is round.)
        out, steepest = np.hypot(x, y), 1 / min(*long[:2], long[2] / tube)
        off, high = out - ring, tube * z
        away = np.hypot(off, high)
        outward, upward = off / np.maximum(away, 1e-300), high / np.maximum(away, 1e-300)
        near = np.maximum(out, 1e-300)
        slopes = (outward * x / near / long[0], outward * y / near / long[1], upward * tube / long[2])
        # Within its ring it is not convex.
        return np.where(off > 0, from_surface(away - tube, slopes, steepest), (away - tube) / steepest)
