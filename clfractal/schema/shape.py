"""What objects have in common, above all shapes: where they stand, how they are joined, what is inside."""

import math
from abc import abstractmethod
from collections.abc import Sequence
from functools import reduce
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import Field

from clfractal.schema.base import Angle, Direction, Length, Position, Vector, length, turn
from clfractal.schema.fields import SCALE
from clfractal.schema.kinds import Element, members
from clfractal.schema.names import MaterialName

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats: TypeAlias = NDArray[np.float64]

Ball: TypeAlias = tuple[Vector, float]
"""A centre and a radius, scene units."""
AXES: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

Angles = Annotated[tuple[Angle, Angle, Angle], Field(strict=False)]
Sides = Annotated[tuple[Length, Length, Length], Field(strict=False)]


def turned_axes(rotation: Vector) -> tuple[Vector, Vector, Vector]:
    """The three axes after turns about those of space, in degrees; each has length 1."""
    turns = list(zip(AXES, rotation, strict=True))
    x, y, z = (reduce(lambda turned, each: turn(turned, *each), turns, axis) for axis in AXES)
    return x, y, z


class ObjectBase(Element):
    """Keys that every object has.

    Attributes:
        of_rays: whether only rays find it, and no voxels or planes.
    """

    of_rays: ClassVar[bool] = False

    material: MaterialName | None = Field(
        None, description="one of `materials`; null: as `material`, in its colour"
    )
    position: Position = Field((0.0, 0.0, 0.0), description="its middle, or a point of a plane; scene units")


class Joined(ObjectBase):
    """An object that may be a part of the set: joined to it, or cut out of it."""

    join: Literal["union", "smooth_union", "cut", "intersection"] = Field(
        "union",
        description="with the set and the formulas above it in the file: beside them; flowing together; taken out of"
        " them; or only what both have in common is left",
    )
    smoothness: Annotated[Length, SCALE] = Field(
        0.2, description="of a smooth union: how far apart surfaces begin to flow together, scene units"
    )


class Simple(Joined):
    """A body that an equation tells, a shape; of a formula only its chain knows what is inside.

    A shape is a class in a file of `clfractal/elements/shapes`, and the file of the same name in
    `kernels/elements/shapes`, which says what functions it has; as a light it is asked for by those of `emitters` there.
    """

    spans: ClassVar[int] = 1
    """In how many parts a line can be inside of it."""

    @property
    def form(self) -> Vector:
        """Numbers of its own that its kernel functions are given, beside where its sides are."""
        return (0.0, 0.0, 0.0)

    @abstractmethod
    def holds(self, point: Vector) -> bool:
        """Whether a point is inside."""

    @abstractmethod
    def away(self, points: "Floats") -> "Floats":
        """How far points of shape (n, 3) are from it, scene units; below 0 inside. Or less than that, either way."""


class Level(ObjectBase):
    """A surface without an end, seen from both sides."""

    normal: Direction = Field((0.0, 0.0, 1.0), description="direction that it faces")


class Solid(Simple):
    """A shape with an inside, around its middle.

    Attributes:
        rounded: how many of its axes, from the first on, round off what is across the others: a ball's three, a cylinder's
            two; of a box none.
    """

    rounded: ClassVar[int] = 0

    rotation: Angles = Field(
        (0.0, 0.0, 0.0), description="about the x axis of space, then y, then z, degrees"
    )
    scale: Annotated[Sides, SCALE] = Field(
        (1.0, 1.0, 1.0), description="factors along its own axes, before it is rotated"
    )

    @classmethod
    @abstractmethod
    def first(cls, radius: float) -> dict[str, Any]:
        """Values of one that is added in the window: it fills a ball of this radius."""

    @property
    @abstractmethod
    def half_sides(self) -> Vector:
        """Of the box around it, along its own axes, before `scale`."""

    @property
    def axes(self) -> tuple[Vector, Vector, Vector]:
        """From its middle to the ends of its own three axes, scene units."""
        turned = zip(turned_axes(self.rotation), self.half_sides, self.scale, strict=True)
        a, b, c = ((x * half * f, y * half * f, z * half * f) for (x, y, z), half, f in turned)
        return a, b, c

    @property
    def ball(self) -> Ball:
        """Around it."""
        return self.position, math.hypot(*(length(axis) for axis in self.axes))

    @property
    def reach(self) -> float:
        """How far it is from its middle to any place of it at most, scene units."""
        long = [length(axis) for axis in self.axes]
        return math.hypot(max(long[: self.rounded], default=0.0), *long[self.rounded :])

    def own_place(self, point: Vector) -> Vector:
        """A point in units of `axes` from its middle."""
        offset = [p - q for p, q in zip(point, self.position, strict=True)]
        # Divided by lengths: the squares of short axes would be 0.
        x, y, z = (
            sum(o * (a / long) for o, a in zip(offset, axis, strict=True)) / long
            for axis, long in ((axis, math.hypot(*axis)) for axis in self.axes)
        )
        return (x, y, z)

    def own_places(self, points: "Floats") -> "tuple[Floats, Floats]":
        """Points of shape (n, 3) along its own axes from its middle, scene units, and the lengths of `axes`."""
        import numpy as np

        axes = np.array(self.axes)
        long = np.linalg.norm(axes, axis=1)
        return (points - self.position) @ (axes / long[:, None]).T, long


def from_surface(value: "Floats", slopes: Sequence["Floats"], steepest: float) -> "Floats":
    """How far points are from where a function is 0 that is convex above it, or less than that; below 0 where it is below.

    A convex function lies above its tangents, so no step from outside that is shorter than value / |slopes| gets there.

    Args:
        value: the function, shape (n,).
        slopes: its derivatives where it is above 0, scene units.
        steepest: the most that it changes in a step of one scene unit, where it is below.
    """
    import numpy as np

    steep = np.sqrt(sum(slope**2 for slope in slopes))
    return np.asarray(value / np.where(value > 0, np.maximum(steep, 1e-300), steepest))


def solids() -> tuple[type[Solid], ...]:
    """All kinds of solids."""
    return tuple(kind for kind in members("shapes") if issubclass(kind, Solid))
