"""A plane, an object without an end."""

from typing import TYPE_CHECKING, Literal

from clfractal.schema.base import Vector
from clfractal.schema.shape import Level, Simple

if TYPE_CHECKING:
    from clfractal.schema.shape import Floats


class PlaneObject(Simple, Level):
    """A plane without an end; as a part of the set, all below it."""

    place = 10
    type: Literal["plane"] = "plane"

    def holds(self, point: Vector) -> bool:
        """Whether a point is below it."""
        return sum((p - q) * n for p, q, n in zip(point, self.position, self.normal, strict=True)) < 0

    def away(self, points: "Floats") -> "Floats":
        """As of every shape."""
        import numpy as np

        normal = np.array(self.normal)
        return np.asarray((points - self.position) @ (normal / np.linalg.norm(normal)))
