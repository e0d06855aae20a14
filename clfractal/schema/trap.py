"""Orbit traps, of colours, glow and lights."""

from abc import abstractmethod
from typing import Annotated, Any, ClassVar

from pydantic import Field

from clfractal.schema.base import Direction, Length, Position, Section, unit
from clfractal.schema.kinds import Kind, OneOf, by_word


class TrapShape(Kind):
    """A shape to which orbits come near, by the file of its name in `kernels/elements/traps`, too.

    Attributes:
        keys: those of a trap that count for it.
    """

    keys: ClassVar[tuple[str, ...]] = ()

    @staticmethod
    @abstractmethod
    def away(offsets: Any, along: Any, axis: Any, radius: float) -> Any:
        """How far places of z are from it.

        Args:
            offsets: from the trap's centre to the places, shape (n, 3), in NumPy.
            along: their parts along its direction.
            axis: this direction, length 1.
            radius: the trap's.
        """


class Trap(Section):
    """A shape in the formula's space; the colour follows the smallest distance of the orbit from it."""

    shape: Annotated[str, OneOf("traps")] = Field(
        "point", description="the shape to which the orbit's distance is measured"
    )
    center: Position = Field(
        (0.0, 0.0, 0.0), description="the point, a point of the axis or plane, or the sphere's centre"
    )
    direction: Direction = Field((0.0, 0.0, 1.0), description="the axis's direction, or the plane's normal")
    radius: Length = Field(1.0, description="the sphere's radius")

    @property
    def used_keys(self) -> tuple[str, ...]:
        """The keys that count for its shape."""
        shape: type[TrapShape] = by_word("traps")[self.shape]
        return ("shape", *shape.keys)

    def away(self, points: Any) -> Any:
        """From points in z, an array of shape (n, 3), to the trap."""
        offsets, axis = points - self.center, unit(self.direction)
        shape: type[TrapShape] = by_word("traps")[self.shape]
        return shape.away(offsets, offsets @ axis, axis, self.radius)
